// SPDX-License-Identifier: BSD-3-Clause
#include "api/confidence.hpp"

#include <cmath>

namespace gpureg {

void set_confidences(std::vector<RegistrationMode>& modes) {
  for (RegistrationMode& mode : modes) {
    const PoseEvidence& e = mode.evidence;
    mode.confidence = std::sqrt(e.match_support) * 0.5 * (e.source_balanced_overlap + e.target_balanced_overlap) *
                      std::exp(-4.0 * (e.source_impossible + e.target_impossible));
  }
}

}  // namespace gpureg
