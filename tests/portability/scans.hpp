// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "gpureg/point_cloud.hpp"

/// Scans of two small rooms by integers and + - * / of double alone, so that every machine makes
/// the same bytes: the distributions of the standard library differ between libraries.
namespace gpureg::test {

/// SplitMix64 (Steele et al. 2014).
class IntegerRandom {
 public:
  explicit IntegerRandom(std::uint64_t seed) : state_(seed) {}
  /// Multiple of 2^-32 in [0, 1).
  double unit() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return static_cast<double>((z ^ (z >> 31)) >> 32) / 4294967296.0;
  }
  /// Sum of four, of standard deviation 1 in units of `scale`.
  double noise(double scale) {
    const double a = unit(), b = unit(), c = unit(), d = unit();
    return (((a + b) + (c + d)) - 2.0) * 1.7320508075688772 * scale;
  }

 private:
  std::uint64_t state_;
};

using Point = std::array<double, 3>;

/// Rotation by a quaternion of integers, then a shift.
struct IntegerMotion {
  int w, x, y, z;
  Point shift;

  Point operator()(const Point& p) const {
    const double n = w * w + x * x + y * y + z * z;
    const int r[3][3] = {{w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)},
                         {2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)},
                         {2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z}};
    Point out;
    for (int k = 0; k < 3; ++k) {
      const double a = r[k][0] / n * p[0], b = r[k][1] / n * p[1], c = r[k][2] / n * p[2];
      out[static_cast<std::size_t>(k)] = ((a + b) + c) + shift[static_cast<std::size_t>(k)];
    }
    return out;
  }
};

/// What a scan covers and where it lies.
struct ScanOfRoom {
  int room;                ///< 0 or 1
  double least_x, most_x;  ///< metres, of 3.2
  bool viewpoint;          ///< known
  IntegerMotion motion;
};

inline PointCloud scan_of_room(const ScanOfRoom& scan, std::uint64_t seed) {
  constexpr double kPointsPerSquareMetre = 700, kNoise = 0.003;
  IntegerRandom random(seed);
  PointCloud cloud;
  const auto add = [&](Point p) {
    if (p[0] < scan.least_x || p[0] > scan.most_x) return;
    for (double& v : p) v += random.noise(kNoise);
    const Point q = scan.motion(p);
    cloud.points.emplace_back(static_cast<float>(q[0]), static_cast<float>(q[1]),
                              static_cast<float>(q[2]));
  };
  /// A patch over (u, v) with a bulge, of an area of about `area`.
  const auto patch = [&](double area, const Point& corner, const Point& a, const Point& b,
                         const Point& bulge) {
    for (int k = static_cast<int>(area * kPointsPerSquareMetre); k > 0; --k) {
      const double u = random.unit(), v = random.unit(), h = u * (1 - u) * v * (1 - v) * 16;
      Point p;
      for (std::size_t i = 0; i < 3; ++i) p[i] = ((corner[i] + u * a[i]) + v * b[i]) + h * bulge[i];
      add(p);
    }
  };
  const auto box = [&](const Point& c, const Point& x, const Point& y, double height) {
    const Point up{0, 0, height}, top{c[0], c[1], c[2] + height};
    const Point far_x{c[0] + x[0], c[1] + x[1], c[2]}, far_y{c[0] + y[0], c[1] + y[1], c[2]};
    patch(0.5 * height, c, x, up, {});
    patch(0.5 * height, far_y, x, up, {});
    patch(0.5 * height, c, y, up, {});
    patch(0.5 * height, far_x, y, up, {});
    patch(0.25, top, x, y, {0, 0, 0.06});
  };
  patch(7.7, {0, 0, 0}, {3.2, 0, 0}, {0, 2.4, 0}, {0, 0, 0.02});
  patch(6.4, {0, 0, 0}, {3.2, 0, 0}, {0, 0, 2.0}, {0, 0.05, 0});
  patch(4.8, {0, 0, 0}, {0, 2.4, 0}, {0, 0, 2.0}, {-0.04, 0, 0});
  if (scan.room == 0) {
    box({0.4, 0.9, 0}, {0.8, 0.6, 0}, {-0.3, 0.4, 0}, 0.75);
    box({1.6, 0.2, 0}, {0.5, 0, 0}, {0, 0.3, 0}, 1.3);
    box({2.3, 1.2, 0}, {0.3, -0.2, 0}, {0.4, 0.6, 0}, 0.5);
    patch(0.6, {1.3, 1.5, 0.4}, {0.6, 0.1, 0.2}, {-0.1, 0.6, 0.1}, {0.02, 0, 0.3});
  } else {
    box({0.2, 0.2, 0}, {1.0, 0, 0}, {0, 0.5, 0}, 0.4);
    box({1.9, 1.4, 0}, {0.6, 0.25, 0}, {-0.25, 0.6, 0}, 0.9);
    patch(0.9, {2.2, 0.1, 0.8}, {0.8, 0, 0.1}, {0, 0.5, 0.5}, {0, 0.1, 0.2});
  }
  if (scan.viewpoint) {
    const Point q = scan.motion({1.9, 1.8, 1.5});
    cloud.viewpoints.emplace_back(static_cast<float>(q[0]), static_cast<float>(q[1]),
                                  static_cast<float>(q[2]));
  }
  return cloud;
}

/// Six scans of one room, with and without viewpoints, and one of another room.
inline std::vector<PointCloud> portable_scans() {
  const ScanOfRoom scans[] = {{0, 0.0, 3.2, false, {1, 0, 0, 0, {0, 0, 0}}},
                              {0, 0.0, 2.6, false, {3, 1, -2, 1, {0.5, -1.25, 2}}},
                              {0, 0.5, 3.2, false, {1, 2, 3, -1, {-4, 0.75, 0.25}}},
                              {0, 0.0, 3.2, true, {5, 0, 1, 2, {1.5, 1.5, -0.5}}},
                              {0, 0.0, 2.4, true, {2, -1, 0, 3, {0, 7, -1}}},
                              {0, 0.8, 3.2, true, {1, 1, 0, 1, {-2, -2, 0}}},
                              {1, 0.0, 3.2, true, {4, 1, 1, -1, {0.25, 0, 3}}}};
  std::vector<PointCloud> out;
  std::uint64_t seed = 1;
  for (const ScanOfRoom& scan : scans) out.push_back(scan_of_room(scan, seed++));
  return out;
}

}  // namespace gpureg::test
