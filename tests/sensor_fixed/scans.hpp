// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <functional>
#include <random>
#include <vector>

/// Scans from the origin.
namespace gpureg::test {

using Points = std::vector<Eigen::Vector3f>;

/// Something that a ray from the origin along a unit vector hits, and at which range; 0: nothing.
using Scene = std::function<float(const Eigen::Vector3f& direction)>;

/// A box around the sensor.
inline float room(const Eigen::Vector3f& d) {
  const Eigen::Vector3f low(-2.5f, -3, -1.4f), high(4, 2, 1.3f);
  float range = 1e9f;
  for (int k = 0; k < 3; ++k)
    if (d[k] != 0) range = std::min(range, (d[k] > 0 ? high[k] : low[k]) / d[k]);
  return range;
}

inline Eigen::Vector3f any_direction(std::mt19937& random) {
  std::normal_distribution<float> normal;
  return Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized();
}

inline Points scan(const Scene& scene, std::size_t rays, float noise, std::mt19937& random) {
  std::normal_distribution<float> error(0, noise);
  Points out;
  for (std::size_t k = 0; k < rays; ++k) {
    const Eigen::Vector3f d = any_direction(random);
    if (const float range = scene(d); range > 0) out.emplace_back(d * (range + error(random)));
  }
  return out;
}

}  // namespace gpureg::test
