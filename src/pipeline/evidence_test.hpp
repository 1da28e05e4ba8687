// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/side_evidence.hpp"
#include "settings/settings.hpp"

namespace gpureg::pipeline {

inline EvidenceTest evidence_test(const RegistrationSettings& options) {
  const EvidenceSettings& e = options.evidence;
  return {inlier_test(options.prepare.max_correspondence_distance, e.max_normal_angle),
          e.free_space_margin, e.min_range};
}

}  // namespace gpureg::pipeline
