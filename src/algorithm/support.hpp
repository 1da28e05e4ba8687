// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/rigid.hpp"

namespace gpureg {

/// Support of a hypothesis. Integers, so that every order of summation gives the same bits.
struct Support {
  std::uint32_t inliers;
  std::uint32_t hypothesis;  ///< its number among all drawn
  /// sum over the inliers of fixed-point (distance / max distance)^2, see fixed_residual
  std::uint64_t residual;
};

constexpr float kResidualScale = 1048576.0f;  ///< 2^20 steps for one squared max distance

GPUREG_HD std::uint32_t fixed_residual(float squared_distance, float inverse_max_squared) {
  return static_cast<std::uint32_t>(squared_distance * inverse_max_squared * kResidualScale);
}

/// The total order of results: more inliers, then the smaller residual, then the lower number.
GPUREG_HD bool better(const Support& a, const Support& b) {
  if (a.inliers != b.inliers) return a.inliers > b.inliers;
  if (a.residual != b.residual) return a.residual < b.residual;
  return a.hypothesis < b.hypothesis;
}

/// Truncated squared error over all n points: inliers cost their residual, the others one squared
/// max distance (MSAC).
GPUREG_HD std::uint64_t truncated_cost(const Support& s, std::uint32_t n) {
  return s.residual +
         static_cast<std::uint64_t>(n - s.inliers) * static_cast<std::uint64_t>(kResidualScale);
}

/// Normal test of an inlier: angle between the moved source normal and the target's at most the
/// limit; a missing normal fails unless the test is off (min_cosine <= -1).
GPUREG_HD bool normals_agree(Vec3 moved_source_normal, Vec3 target_normal, float min_cosine) {
  const float cosine = dot(moved_source_normal, target_normal);
  // A zero normal gives a cosine of 0, which would pass limits beyond 90 degrees.
  return (min_cosine <= -1.0f) |
         ((cosine >= min_cosine) & !is_zero(moved_source_normal) & !is_zero(target_normal));
}

}  // namespace gpureg
