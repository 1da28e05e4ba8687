// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <cstring>
#include <string>

#include "fields/evidence.hpp"

namespace gpureg::test {

/// Equal bytes of every number but weakest_direction, which is turned by the pose in double: a pose
/// that went through a matrix has other last digits.
inline bool same_evidence(const PoseEvidence& a, const PoseEvidence& b) {
  bool same = true;
  fields::each<PoseEvidence>([&](const std::string& name, auto member, const fields::Field&) {
    if (name != "weakest_direction")
      same = same && std::memcmp(&(a.*member), &(b.*member), sizeof(a.*member)) == 0;
  });
  for (std::size_t k = 0; k < a.weakest_direction.size(); ++k)
    same = same && std::abs(a.weakest_direction[k] - b.weakest_direction[k]) < 1e-9;
  return same;
}

}  // namespace gpureg::test
