// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/closest.hpp"
#include "algorithm/inlier.hpp"
#include "pipeline/types.hpp"

namespace gpureg::cpu {

/// Adds point i of the source, at its moved position q with closest target point c, to s if it is
/// an inlier.
inline void count_inlier(const CloudView& source, const CloudView& target, const Rigid& pose,
                         const InlierTest& t, std::uint32_t i, Closest c, Support& s) {
  if (c.index == kNoValue) return;
  const bool agree =
      normals_agree(rotate(pose, source.normals[i]), target.normals[c.index], t.min_cosine);
  s.inliers += agree ? 1u : 0u;
  s.residual += agree ? fixed_residual(c.squared_distance, t.inverse_max_squared) : 0u;
}

inline void count_point(const CloudView& source, const CloudView& target, const Rigid& pose,
                        const InlierTest& t, std::uint32_t i, Support& s) {
  count_inlier(
      source, target, pose, t, i,
      find_closest(target.closest, target.points, apply(pose, source.points[i]), t.max_squared), s);
}

}  // namespace gpureg::cpu
