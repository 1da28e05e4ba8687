// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/point_cloud.hpp"
#include "sensor_fixed/scans.hpp"

/// What a sensor sees of its carrier, in its own frame.
namespace gpureg::test {

using Part = std::function<Eigen::Vector3f(std::mt19937&)>;

/// Shows so large a share of a part in every scan.
inline void add(const Part& part, double share, std::vector<Points>& scans, std::mt19937& random) {
  for (Points& scan : scans) {
    const auto rows =
        static_cast<std::size_t>(share / (1 - share) * static_cast<double>(scan.size()));
    for (std::size_t k = 0; k < rows; ++k) scan.push_back(part(random));
  }
}

inline float between(float low, float high, std::mt19937& random) {
  return std::uniform_real_distribution<float>(low, high)(random);
}
inline Eigen::Vector3f of_vehicle(std::mt19937& random) {
  return {between(-0.5f, 0.3f, random), between(-0.25f, 0.25f, random),
          between(-0.31f, -0.3f, random)};
}
inline Eigen::Vector3f of_hand(std::mt19937& random) {
  return Eigen::Vector3f(0.5f, 0.1f, -0.2f) + 0.08f * any_direction(random);
}
inline Eigen::Vector3f of_disc(std::mt19937& random) {
  const float turn = between(0, 6.2832f, random), radius = 0.4f * std::sqrt(between(0, 1, random));
  return {radius * std::cos(turn), radius * std::sin(turn), between(-0.26f, -0.25f, random)};
}
inline Eigen::Vector3f of_frame(std::mt19937& random) {
  const float side = between(-0.25f, 0.25f, random);
  return random() % 2 == 0 ? Eigen::Vector3f(0.4f, side, 0.2f) : Eigen::Vector3f(0.4f, 0.25f, side);
}

inline std::vector<PointCloudView> views_of(const std::vector<Points>& scans) {
  std::vector<PointCloudView> out;
  for (const Points& scan : scans) out.emplace_back(scan);
  return out;
}

}  // namespace gpureg::test
