// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/rigid.hpp"

namespace gpureg {

/// Constraints on the pose of the moved cloud, in local coordinates of both clouds. The default
/// permits every pose.
struct PriorTest {
  bool gravity = false, pose = false;
  bool swapped = false;                       ///< the source of the pair is the fixed cloud
  Vec3 moved_up{0, 0, 1}, fixed_up{0, 0, 1};  ///< unit vectors
  float min_up_cosine = -1;
  Rigid expected{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};  ///< fixed from moved
  float min_trace = -1;
  float max_squared_distance = 0;
};

/// True unless the pose deviates too far from the vertical or from the expected rotation, or moves
/// the local origin of the source of the pair too far from its expected position.
GPUREG_HD bool permitted(const PriorTest& prior, const Rigid& pose) {
  if (prior.gravity && !(dot(rotate(pose, prior.moved_up), prior.fixed_up) >= prior.min_up_cosine))
    return false;
  if (!prior.pose) return true;
  float trace = 0.0f;
  for (int k = 0; k < 9; ++k) trace = fmaf(pose.r[k], prior.expected.r[k], trace);
  // In a swapped pair the inverse moves the source.
  const Rigid a = prior.swapped ? inverse(pose) : pose,
              b = prior.swapped ? inverse(prior.expected) : prior.expected;
  const Vec3 shift{a.t[0] - b.t[0], a.t[1] - b.t[1], a.t[2] - b.t[2]};
  return (trace >= prior.min_trace) & (squared_norm(shift) <= prior.max_squared_distance);
}

}  // namespace gpureg
