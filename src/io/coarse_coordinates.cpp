// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "gpureg/io.hpp"

namespace gpureg::io {

std::string coarse_coordinates(const PointCloud& cloud) {
  if (!cloud.origin.isZero(0)) return {};
  constexpr float kLarge = 1e5f, kSteps = 1 << 17;
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (const Eigen::Vector3f& point : cloud.points) {
    if (!point.allFinite()) continue;
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const float largest = std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff());
  const float step = std::nextafter(largest, std::numeric_limits<float>::infinity()) - largest;
  if (low.x() > high.x() || largest <= kLarge || step * kSteps <= (high - low).maxCoeff())
    return {};
  char numbers[96];
  std::snprintf(numbers, sizeof(numbers), "coordinates up to %.7g resolve %.2g in float32",
                static_cast<double>(largest), static_cast<double>(step));
  return std::string(numbers) +
         ", which the file holds; write it with double coordinates, or subtract an offset before "
         "it is written";
}

}  // namespace gpureg::io
