// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstring>

#include "gpureg/evidence.hpp"

namespace gpureg::test {

/// Equal bytes of every number but weakest_direction, which is turned by the pose in double: a pose
/// that went through a matrix has other last digits.
inline bool same_evidence(const PoseEvidence& a, const PoseEvidence& b) {
  constexpr std::size_t kFirst = offsetof(PoseEvidence, match_support);
  constexpr std::size_t kEnd = offsetof(PoseEvidence, weakest_direction);
  const char* x = reinterpret_cast<const char*>(&a);
  const char* y = reinterpret_cast<const char*>(&b);
  bool same =
      a.match_inliers == b.match_inliers && std::memcmp(x + kFirst, y + kFirst, kEnd - kFirst) == 0;
  for (std::size_t k = 0; k < a.weakest_direction.size(); ++k)
    same = same && std::abs(a.weakest_direction[k] - b.weakest_direction[k]) < 1e-9;
  return same;
}

}  // namespace gpureg::test
