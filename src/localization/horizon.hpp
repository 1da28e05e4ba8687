// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/whole.hpp"

namespace gpureg::localization {

/// Where a direction meets a cube around its origin: a face, two coordinates in [-1, 1], and the
/// distance of the face that the end of the direction lies on.
struct CubeRay {
  int face;
  float u, v, depth;
};

inline CubeRay cube_ray(const Eigen::Vector3f& d) {
  constexpr float kLeast = 1e-20f;
  Eigen::Index axis = 0;
  const float depth = d.cwiseAbs().maxCoeff(&axis), scale = 1 / std::max(depth, kLeast);
  return {static_cast<int>(2 * axis) + (d[axis] < 0 ? 1 : 0), d[(axis + 1) % 3] * scale,
          d[(axis + 2) % 3] * scale, depth};
}

/// Row or column, of `edge` ones, of a coordinate.
inline int cube_row(float at, int edge) {
  return whole((at + 1) * 0.5f * static_cast<float>(edge), 0, edge - 1);
}

/// How far the scans of one sensor position saw in each direction. What other scans know beyond was
/// not seen from there.
struct Horizon {
  static constexpr int kEdge = 24;
  static constexpr std::uint16_t kUnlimited = std::numeric_limits<std::uint16_t>::max();
  std::array<std::uint16_t, 6 * kEdge * kEdge> steps{};

  static std::size_t cell(const Eigen::Vector3f& direction) {
    const CubeRay ray = cube_ray(direction);
    return static_cast<std::size_t>((ray.face * kEdge + cube_row(ray.v, kEdge)) * kEdge +
                                    cube_row(ray.u, kEdge));
  }
  void see(const Eigen::Vector3f& direction, float step) {
    const float far = direction.norm() / step;
    std::uint16_t& known = steps[cell(direction)];
    constexpr std::uint16_t kMost = kUnlimited - 1;
    known = std::max(known, whole(std::ceil(far), std::uint16_t{0}, kMost));
  }
  bool reaches(const Eigen::Vector3f& direction, float step) const {
    const std::uint16_t known = steps[cell(direction)];
    return known == kUnlimited || direction.norm() <= static_cast<float>(known) * step;
  }
};

/// Length of a step: an eighth of a voxel, so that 65,534 steps are 8,000 voxels.
inline float horizon_step(float voxel_size) { return voxel_size / 8; }

}  // namespace gpureg::localization
