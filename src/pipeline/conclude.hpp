// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/types.hpp"

namespace gpureg::pipeline {

inline double inlier_ratio(const RegistrationStatistics& s) {
  return s.points_scored > 0 ? static_cast<double>(s.inliers) / s.points_scored : 0.0;
}

/// Reason for a missing alignment: the first stage without output; none where the pose passes the
/// threshold.
inline RegistrationReason reason_of(const RegistrationStatistics& s, bool has_pose,
                                    const RegistrationSettings& options) {
  if (s.source_points < 4) return RegistrationReason::too_few_source_points;
  if (s.target_points < 4) return RegistrationReason::too_few_target_points;
  if (s.correspondences < 4) return RegistrationReason::no_usable_features;
  if (s.survivors == 0) return RegistrationReason::no_hypothesis_survived;
  if (s.scored == 0 || !has_pose) return RegistrationReason::degenerate_geometry;
  if (s.inliers == 0 || inlier_ratio(s) < static_cast<double>(options.quadruples.min_inlier_ratio))
    return RegistrationReason::inlier_ratio_too_low;
  return RegistrationReason::none;
}

/// Quadruples are drawn where there are enough matches for one.
inline std::uint64_t quadruples_drawn(std::uint32_t matches, const RegistrationSettings& options) {
  return matches >= 4 ? options.quadruples.count : 0;
}

/// Counts of one pair after each stage.
struct PairCounts {
  std::uint32_t source_points, target_points, correspondences;
  std::uint64_t hypotheses, survivors, scored;
};

inline void count_stages(const PairCounts& counts, RegistrationStatistics& s) {
  s.source_points = counts.source_points;
  s.target_points = counts.target_points;
  s.correspondences = counts.correspondences;
  s.hypotheses = counts.hypotheses;
  s.survivors = counts.survivors;
  s.scored = counts.scored;
}

/// The same for the default method: each seed that gave a pose is scored.
inline void count_seeds(std::uint32_t source_points, std::uint32_t target_points,
                        std::uint32_t matches, std::size_t candidates,
                        const RegistrationSettings& options, RegistrationStatistics& s) {
  const std::uint32_t seeds =
      matches < options.compatibility.seeds ? matches : options.compatibility.seeds;
  count_stages({source_points, target_points, matches, seeds, candidates, candidates}, s);
}

/// Best hypothesis of LoopSmart.
struct FinalPose {
  bool found;
  Pose<double> pose;
  Support support;  ///< under quadruples.max_normal_angle, by which hypotheses are ranked
  std::uint32_t iterations;
};
struct FinalVerification {
  Support support;  ///< under quadruples.max_verification_normal_angle
  Moments source, target;
};

inline void conclude_pair(const PairCounts& counts, const FinalPose& pose,
                          const FinalVerification& verification,
                          const RegistrationSettings& options, PairOutcome& out) {
  RegistrationStatistics& s = out.statistics;
  count_stages(counts, s);
  s.points_scored = counts.source_points;
  s.consensus = pose.support.inliers;
  s.inliers = verification.support.inliers;
  s.refine_iterations = pose.iterations;
  out.has_pose = pose.found;
  out.pose = pose.pose;
  out.support = verification.support;
  out.source_moments = verification.source;
  out.target_moments = verification.target;
  out.reason = reason_of(s, out.has_pose, options);
}

}  // namespace gpureg::pipeline
