// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "surfel/surfel_map.hpp"

/// Depth images of shapes with known surfaces.
namespace surfel::test {

constexpr int kWidth = 320, kHeight = 240;
constexpr Camera kCamera{262.5f, 262.5f, 159.5f, 119.5f};

inline Pose shifted(float x, float y = 0, float z = 0) {
  Pose pose;
  pose.t[0] = x;
  pose.t[1] = y;
  pose.t[2] = z;
  return pose;
}

/// Depth along the optical axis of the first hit of a ray (origin, direction with z = 1).
using Shape = std::function<std::optional<double>(const double (&)[3], const double (&)[3])>;

/// The wall z = distance.
inline Shape wall(double distance) {
  return [=](const double(&o)[3], const double(&)[3]) { return distance - o[2]; };
}

inline Shape ball(double x, double y, double z, double radius) {
  return [=](const double(&o)[3], const double(&d)[3]) -> std::optional<double> {
    const double p[3] = {o[0] - x, o[1] - y, o[2] - z};
    const double a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2],
                 b = p[0] * d[0] + p[1] * d[1] + p[2] * d[2],
                 c = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] - radius * radius,
                 root = b * b - a * c;
    if (root < 0) return std::nullopt;
    return (-b - std::sqrt(root)) / a;
  };
}

/// The view of a camera that is shifted, not turned.
inline std::vector<float> depth_of(const Shape& shape, const Pose& pose) {
  std::vector<float> depth(kWidth * kHeight, 0.0f);
  const double origin[3] = {static_cast<double>(pose.t[0]), static_cast<double>(pose.t[1]),
                            static_cast<double>(pose.t[2])};
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const double ray[3] = {
          (u - static_cast<double>(kCamera.cx)) / static_cast<double>(kCamera.fx),
          (v - static_cast<double>(kCamera.cy)) / static_cast<double>(kCamera.fy), 1};
      if (const auto z = shape(origin, ray))
        depth[static_cast<std::size_t>(v * kWidth + u)] = static_cast<float>(*z);
    }
  }
  return depth;
}

inline void fuse(SurfelMap& map, const std::vector<float>& depth, const Pose& pose, int frame,
                 int since = 0, const std::uint8_t* colour = nullptr) {
  map.fuse({kWidth, kHeight, depth.data(), colour}, kCamera, pose, frame, since);
}

}  // namespace surfel::test
