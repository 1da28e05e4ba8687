// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace gpureg {

enum class RegistrationStatus : std::uint8_t {
  aligned,  ///< target_from_source passed every threshold
  /// no pose passed; reason says why, and target_from_source holds the best candidate where
  /// has_candidate
  not_aligned,
  skipped  ///< never tried, because the batch was cancelled before
};

/// Why a pair is not aligned. none means aligned.
enum class RegistrationReason : std::uint8_t {
  none,
  too_few_source_points,  ///< fewer than 4 usable points after downsampling
  too_few_target_points,
  /// fewer than 4 correspondences: points without neighbours have no feature
  no_usable_features,
  no_hypothesis_survived,  ///< all quadruples failed the polygon test (Proposal::quadruples)
  /// all surviving quadruples were collinear or coincident; no seed's neighbourhood determined a
  /// pose
  degenerate_geometry,
  /// the best candidate is below ScoreOptions::min_inlier_ratio (Proposal::quadruples)
  inlier_ratio_too_low,
  /// the best candidate is below RegistrationOptions::min_confidence (Proposal::compatibility)
  confidence_too_low,
  contradicts_prior,  ///< every pose found contradicts the RegistrationPrior of the pair
  cancelled
};

const char* to_string(RegistrationStatus status);
const char* to_string(RegistrationReason reason);
/// One sentence for a person.
const char* explain(RegistrationReason reason);

/// What went in and what was left after each stage of one pair: enough to answer "why did it fail".
/// Hypotheses are quadruples of matches (Proposal::quadruples) or seeds (Proposal::compatibility).
struct RegistrationStatistics {
  std::uint32_t source_points = 0;  ///< prepared points of the source
  std::uint32_t target_points = 0;
  /// matches that hypotheses are made of, at most CompatibilityOptions::max_matches with seeds
  std::uint32_t correspondences = 0;
  std::uint64_t hypotheses = 0;  ///< quadruples drawn, or seeds tried
  /// quadruples that passed the polygon test, at most max_survivors; seeds that gave a pose
  std::uint64_t survivors = 0;
  std::uint64_t scored = 0;         ///< of these with a well-defined rigid fit
  std::uint32_t points_scored = 0;  ///< points that the inlier ratio is relative to
  /// Inliers of the returned pose under ScoreOptions::max_normal_angle, what it won by; with seeds
  /// the same as inliers.
  std::uint32_t consensus = 0;
  /// What the inlier ratio counts: under ScoreOptions::max_judged_normal_angle, with seeds under
  /// EvidenceOptions::max_normal_angle.
  std::uint32_t inliers = 0;
  std::uint32_t refine_iterations = 0;  ///< of the returned pose
  /// the target was sampled and scored, being the smaller cloud
  bool swapped = false;
};

/// Wall time of each stage in milliseconds. With Proposal::compatibility sample is the choice of
/// seeds, fit the proposal of poses, score the weighing and selection of candidates, judge the
/// weighing of modes. In a batch a chunk of pairs goes through a stage together: then each pair
/// carries its equal share, so that sums over pairs are right.
struct StageTimings {
  double match = 0, sample = 0, fit = 0, score = 0, refine = 0, judge = 0;
  double total() const { return match + sample + fit + score + refine + judge; }
};

/// Counts and wall times (milliseconds) of the preparation of one cloud.
struct PrepareStatistics {
  std::uint64_t input_points = 0;
  std::uint64_t invalid_points = 0;         ///< dropped for NaN or infinite coordinates
  std::uint32_t points = 0;                 ///< after downsampling
  std::uint32_t points_without_normal = 0;  ///< fewer than 3 neighbours
  /// no neighbour within the feature radius, or no normal: never matched
  std::uint32_t points_without_feature = 0;
  double downsample = 0, normals = 0, features = 0, grid = 0, depth_maps = 0, fronts = 0;
  double total() const { return downsample + normals + features + grid + depth_maps + fronts; }
};

}  // namespace gpureg
