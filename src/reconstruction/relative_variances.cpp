// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/relative_variances.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gpureg::reconstruction {

std::vector<float> relative_variances(const Surface& surface, double noise_range) {
  std::vector<float> out(surface.points.size(), 1.0f);
  if (surface.viewpoints.empty() || !std::isfinite(noise_range)) return out;
  const auto scale = static_cast<float>(1 / (noise_range * noise_range));
  for (std::size_t k = 0; k < out.size(); ++k) {
    float least = std::numeric_limits<float>::infinity();
    for (const Eigen::Vector3f& viewpoint : surface.viewpoints)
      least = std::min(least, (surface.points[k] - viewpoint).squaredNorm());
    const float ratio = least * scale;  // of squared distances: of standard deviations
    out[k] = std::max(1.0f, ratio * ratio);
  }
  return out;
}

}  // namespace gpureg::reconstruction
