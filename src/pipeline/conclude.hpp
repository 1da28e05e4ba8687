// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/types.hpp"

namespace gpureg::pipeline {

inline double inlier_ratio(const RegistrationStatistics& s) {
  return s.points_scored > 0 ? static_cast<double>(s.inliers) / s.points_scored : 0.0;
}

/// The first stage that left nothing is the reason; none where the pose passes the threshold.
inline RegistrationReason reason_of(const RegistrationStatistics& s, bool has_pose, const ScoreOptions& options) {
  if (s.source_points < 4) return RegistrationReason::too_few_source_points;
  if (s.target_points < 4) return RegistrationReason::too_few_target_points;
  if (s.correspondences < 4) return RegistrationReason::no_usable_features;
  if (s.survivors == 0) return RegistrationReason::no_hypothesis_survived;
  if (s.scored == 0 || !has_pose) return RegistrationReason::degenerate_geometry;
  if (s.inliers == 0 || inlier_ratio(s) < static_cast<double>(options.min_inlier_ratio)) return RegistrationReason::inlier_ratio_too_low;
  return RegistrationReason::none;
}

}  // namespace gpureg::pipeline
