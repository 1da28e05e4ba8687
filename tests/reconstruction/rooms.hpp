// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <vector>

#include "gpureg/reconstruction.hpp"
#include "reconstruction/pair_results.hpp"

namespace gpureg::test {

using reconstruction::Surface;

/// Points on three walls of a room and on a box, 5 cm apart, with a millimetre of noise; each
/// number is another sample.
inline Surface room(int number) {
  std::mt19937 random(static_cast<unsigned>(number));
  std::uniform_real_distribution<float> unit;
  std::normal_distribution<float> noise(0, 0.001f);
  Surface out;
  const auto plane = [&](const Eigen::Vector3f& corner, const Eigen::Vector3f& a,
                         const Eigen::Vector3f& b) {
    const Eigen::Vector3f n = a.cross(b).normalized();
    const int count = static_cast<int>(400 * a.cross(b).norm());
    for (int k = 0; k < count; ++k) {
      out.points.push_back(corner + unit(random) * a + unit(random) * b + noise(random) * n);
      out.normals.push_back(n);
    }
  };
  plane({0, 0, 0}, {3, 0, 0}, {0, 2, 0});
  plane({0, 0, 0}, {0, 2, 0}, {0, 0, 2});
  plane({0, 0, 0}, {0, 0, 2}, {3, 0, 0});
  plane({1, 1, 0.5f}, {0.7f, 0, 0}, {0, 0.5f, 0});
  return out;
}

inline Surface moved(const UnalignedIsometry3d& pose, const Surface& surface) {
  Surface out;
  for (std::size_t k = 0; k < surface.points.size(); ++k) {
    out.points.push_back((pose * surface.points[k].cast<double>()).cast<float>());
    out.normals.push_back((pose.linear() * surface.normals[k].cast<double>()).cast<float>());
  }
  return out;
}

/// Five scans of the room with pairs that are 2 to 4 cm off.
struct Rooms {
  PairResults data{5};
  std::vector<Surface> surfaces;
  Rooms() {
    for (std::uint32_t k = 0; k < 5; ++k)
      surfaces.push_back(moved(data.world_from_scan[k].inverse(), room(static_cast<int>(k))));
    for (std::uint32_t k = 1; k < 5; ++k) {
      UnalignedIsometry3d off = data.truth(k, k - 1);
      off.translation() += Eigen::Vector3d(0.02, -0.02, 0.01 * k);
      data.add(k, k - 1, 0.95, off);
    }
  }
};

}  // namespace gpureg::test
