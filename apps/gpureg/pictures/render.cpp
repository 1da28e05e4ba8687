// SPDX-License-Identifier: BSD-3-Clause
#include "pictures/render.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "run/spacing.hpp"

namespace gpureg::cli {
namespace {

constexpr int kSuper = 2;  // supersampling per axis, against jagged edges
constexpr Color kBackground = {250, 250, 248};
constexpr float kFar = std::numeric_limits<float>::infinity();

struct Splat {
  Eigen::Vector3d position;  // in the axes of the view, around the middle of all points
  int layer;
};

struct Pixel {
  float depth = kFar;
  int layer = -1;
};

double quantile(std::vector<double> values, double q) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// A perspective fitted to nearly all splats; outliers may lie outside the picture.
struct Camera {
  double distance = 1, focal = 1, x0 = 0, y0 = 0;

  Camera(const std::vector<Splat>& splats, int width, int height) {
    std::vector<double> radii;
    for (const Splat& s : splats) radii.push_back(s.position.norm());
    // At 2.5 radii the nearest points are about 2.3 times as large as the farthest ones.
    distance = 2.5 * std::max(quantile(std::move(radii), 0.98), 1e-9);
    std::vector<double> xs, ys;
    for (const Splat& s : splats) {
      const double depth = s.position.z() + distance;
      if (depth < 0.2 * distance) continue;
      xs.push_back(s.position.x() / depth);
      ys.push_back(s.position.y() / depth);
    }
    const double left = quantile(xs, 0.003), right = quantile(xs, 0.997);
    const double top = quantile(ys, 0.003), bottom = quantile(ys, 0.997);
    focal = 0.92 *
            std::min(width / std::max(right - left, 1e-6), height / std::max(bottom - top, 1e-6));
    x0 = width / 2.0 - focal * (left + right) / 2;
    y0 = height / 2.0 - focal * (top + bottom) / 2;
  }
};

class Canvas {
 public:
  Canvas(int width, int height)
      : width_(width),
        height_(height),
        pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  // The depth of a disc grows towards its edge, so that neighbouring discs meet halfway.
  void splat(double x, double y, double depth, double radius, double world_radius, int layer) {
    const int x_from = std::max(0, static_cast<int>(std::ceil(x - radius)));
    const int x_to = std::min(width_ - 1, static_cast<int>(std::floor(x + radius)));
    const int y_from = std::max(0, static_cast<int>(std::ceil(y - radius)));
    const int y_to = std::min(height_ - 1, static_cast<int>(std::floor(y + radius)));
    for (int v = y_from; v <= y_to; ++v)
      for (int u = x_from; u <= x_to; ++u) {
        const double r2 = ((u - x) * (u - x) + (v - y) * (v - y)) / (radius * radius);
        if (r2 > 1) continue;
        const auto z = static_cast<float>(depth + 0.5 * r2 * world_radius);
        Pixel& p = at(u, v);
        if (z < p.depth) p = {z, layer};
      }
  }

  /// unit: the difference in depth that occludes fully.
  Image shaded(const std::vector<Layer>& layers, double unit, double near, double far) const {
    Image image(width_, height_, kBackground);
    for (int v = 0; v < height_; ++v)
      for (int u = 0; u < width_; ++u) {
        const Pixel& p = pixels_[index(u, v)];
        if (p.layer < 0) continue;
        const double fog = std::clamp((p.depth - near) / (far - near), 0.0, 1.0);
        const double light = (1 - 0.75 * occlusion(u, v, unit)) * (1 - 0.22 * fog);
        const Color c = layers[static_cast<std::size_t>(p.layer)].color;
        const auto paint = [light](std::uint8_t channel) {
          return static_cast<std::uint8_t>(std::lround(channel * light));
        };
        image.at(u, v) = {paint(c.r), paint(c.g), paint(c.b)};
      }
    return image;
  }

 private:
  std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(u);
  }
  Pixel& at(int u, int v) { return pixels_[index(u, v)]; }

  // Screen-space ambient occlusion in [0, 1]: the share of the neighbourhood that is nearer to the
  // viewer. It darkens edges and corners.
  double occlusion(int u, int v, double unit) const {
    static constexpr int kRings[] = {2, 5, 11, 20};
    static constexpr int kDirections[8][2] = {{1, 0}, {-1, 0},  {0, 1},  {0, -1},
                                              {1, 1}, {-1, -1}, {1, -1}, {-1, 1}};
    const float depth = pixels_[index(u, v)].depth;
    double sum = 0;
    for (const int ring : kRings)
      for (const auto& d : kDirections) {
        const int x = u + d[0] * ring, y = v + d[1] * ring;
        if (x < 0 || x >= width_ || y < 0 || y >= height_) continue;
        const float other = pixels_[index(x, y)].depth;
        if (std::isinf(other)) continue;
        const double step = (depth - other) / (unit * std::sqrt(double(ring)));
        sum += std::clamp(step, 0.0, 1.0);
      }
    return std::min(1.0, sum / 14);
  }

  int width_, height_;
  std::vector<Pixel> pixels_;
};

Image halved(const Image& large) {
  Image image(large.width / kSuper, large.height / kSuper, kBackground);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      int sum[3] = {0, 0, 0};
      for (int k = 0; k < kSuper * kSuper; ++k) {
        const Color& c = large.at(x * kSuper + k % kSuper, y * kSuper + k / kSuper);
        sum[0] += c.r;
        sum[1] += c.g;
        sum[2] += c.b;
      }
      const auto mean = [](int s) {
        return static_cast<std::uint8_t>((s + kSuper * kSuper / 2) / (kSuper * kSuper));
      };
      image.at(x, y) = {mean(sum[0]), mean(sum[1]), mean(sum[2])};
    }
  return image;
}

}  // namespace

Image render(const std::vector<Layer>& layers, const Eigen::Matrix3d& view, int width, int height) {
  std::vector<Splat> splats;
  std::vector<double> spacings;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const std::vector<Eigen::Vector3f> points = finite_points(layers[k].cloud->points);
    spacings.push_back(median_spacing(points, 6));
    for (const Eigen::Vector3f& p : points) {
      splats.push_back(
          {layers[k].pose * (p.cast<double>() + layers[k].cloud->origin), static_cast<int>(k)});
      middle += splats.back().position;
    }
  }
  if (splats.empty()) return Image(width, height, kBackground);
  middle /= static_cast<double>(splats.size());
  for (Splat& s : splats) s.position = view * (s.position - middle);

  const Camera camera(splats, width * kSuper, height * kSuper);
  Canvas canvas(width * kSuper, height * kSuper);
  std::vector<double> depths;
  for (const Splat& s : splats) {
    const double depth = s.position.z() + camera.distance;
    if (depth < 0.2 * camera.distance) continue;
    depths.push_back(depth);
    const double scale = camera.focal / depth;
    // The sixth neighbour on a regular grid is one diagonal away, so discs of half of that touch.
    // Scans are sampled unevenly and need larger discs.
    const double world = 0.75 * spacings[static_cast<std::size_t>(s.layer)];
    const double radius = std::clamp(world * scale, 1.1, 24.0);
    canvas.splat(camera.x0 + s.position.x() * scale, camera.y0 + s.position.y() * scale, depth,
                 radius, radius / scale, s.layer);
  }
  const double near = quantile(depths, 0.02), far = quantile(depths, 0.98);
  const double unit = 6 / (camera.focal / camera.distance);  // six pixels
  return halved(canvas.shaded(layers, unit, near, std::max(far, near * 1.001)));
}

}  // namespace gpureg::cli
