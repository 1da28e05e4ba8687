// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/types.hpp"

namespace gpureg::pipeline {

inline double inlier_ratio(const RegistrationStatistics& s) {
  return s.points_scored > 0 ? static_cast<double>(s.inliers) / s.points_scored : 0.0;
}

/// The first stage that left nothing is the reason; none where the pose passes the threshold.
inline RegistrationReason reason_of(const RegistrationStatistics& s, bool has_pose,
                                    const ScoreOptions& options) {
  if (s.source_points < 4) return RegistrationReason::too_few_source_points;
  if (s.target_points < 4) return RegistrationReason::too_few_target_points;
  if (s.correspondences < 4) return RegistrationReason::no_usable_features;
  if (s.survivors == 0) return RegistrationReason::no_hypothesis_survived;
  if (s.scored == 0 || !has_pose) return RegistrationReason::degenerate_geometry;
  if (s.inliers == 0 || inlier_ratio(s) < static_cast<double>(options.min_inlier_ratio))
    return RegistrationReason::inlier_ratio_too_low;
  return RegistrationReason::none;
}

/// What each stage left of one pair.
struct PairCounts {
  std::uint32_t source_points, target_points, correspondences;
  std::uint64_t survivors, scored;
};
struct FinalPose {
  bool found;
  Pose<double> pose;
  Support support;  ///< under the test that hypotheses are ranked by
  std::uint32_t iterations;
};
struct FinalJudgement {
  Support support;  ///< under the judge's test
  Moments source, target;
};

inline void conclude_pair(const PairCounts& counts, const FinalPose& pose,
                          const FinalJudgement& judgement, const RegistrationOptions& options,
                          PairOutcome& out) {
  RegistrationStatistics& s = out.statistics;
  s.source_points = counts.source_points;
  s.target_points = counts.target_points;
  s.correspondences = counts.correspondences;
  s.hypotheses = s.correspondences >= 4 ? options.hypothesis.count : 0;
  s.survivors = counts.survivors;
  s.scored = counts.scored;
  s.points_scored = counts.source_points;
  s.consensus = pose.support.inliers;
  s.inliers = judgement.support.inliers;
  s.refine_iterations = pose.iterations;
  out.has_pose = pose.found;
  out.pose = pose.pose;
  out.support = judgement.support;
  out.source_moments = judgement.source;
  out.target_moments = judgement.target;
  out.reason = reason_of(s, out.has_pose, options.score);
}

}  // namespace gpureg::pipeline
