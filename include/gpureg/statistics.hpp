// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace gpureg {

enum class RegistrationStatus : std::uint8_t {
  aligned,  ///< target_from_source passed every threshold
  /// No pose passed. reason says why; target_from_source is the best candidate, or NaN.
  not_aligned,
  skipped,  ///< never tried, because the batch was cancelled before
  /// target_from_source is one of several poses that a symmetry makes equivalent, and only their
  /// common confidence passed (RegistrationOptions::accept_symmetry).
  aligned_up_to_symmetry
};

/// Why a pair is not aligned. none means aligned, or aligned up to a symmetry.
enum class RegistrationReason : std::uint8_t {
  none,
  too_few_source_points,  ///< fewer than 4 usable points after downsampling
  too_few_target_points,
  /// Fewer than 4 correspondences: points without neighbours have no feature.
  no_usable_features,
  /// All quadruples failed the polygon test (RegistrationMethod::quadruples).
  no_hypothesis_survived,
  /// All surviving quadruples were collinear or coincident, or no seed determined a pose.
  degenerate_geometry,
  /// The inlier ratio of the best candidate is below min_confidence
  /// (RegistrationMethod::quadruples).
  inlier_ratio_too_low,
  /// The best candidate is below min_confidence (RegistrationMethod::compatibility) for no single
  /// reason below: all of the evidence together is too weak.
  confidence_too_low,
  contradicts_prior,  ///< every pose found contradicts the RegistrationPrior of the pair
  /// The best candidate is below min_confidence because it shares its probability with poses that
  /// a symmetry makes equivalent. Together they pass: RegistrationOptions::accept_symmetry.
  symmetric,
  flat_with_solid,  ///< one cloud is a scan of a 2-D scanner, the other one is not
  cancelled,
  // Why the best candidate is below min_confidence, see diagnose().
  no_candidate,            ///< no pose brings points of both clouds together
  too_few_points,          ///< a cloud has so few prepared points that some pose fits any other
  too_little_overlap,      ///< too small a part of both clouds lies on the other one
  underconstrained,        ///< what overlaps leaves a motion free: one plane, a bare corridor
  ambiguous,               ///< several poses fit about equally well: RegistrationResult::modes
  contradicts_free_space,  ///< points lie where the other cloud observed free space
  clutter,  ///< the points of both clouds are close, but not their surfaces: vegetation, noise
  outside_fitted_range,  ///< clouds of a size that the confidence was not fitted to
  contradicts_loops      ///< loop consistency: the other pairs of the set contradict the pose
};

/// The last enumerator, for loops over all of them.
constexpr RegistrationReason kLastRegistrationReason = RegistrationReason::contradicts_loops;

/// How the viewpoint of a cloud is known. It decides about free space and about the sides of
/// surfaces.
enum class ViewpointSource : std::uint8_t {
  given,    ///< viewpoints were given
  origin,   ///< the origin of the cloud's frame; nothing given, and the surfaces agree with it
  normals,  ///< no viewpoint; the input normals tell the sides of surfaces
  /// No viewpoint: neither free space nor the sides of surfaces are known. Alignments try both
  /// sides.
  none,
  model  ///< no viewpoint; a closed surface with normals that point outwards
};

const char* to_string(ViewpointSource source);
/// @return one English phrase for messages.
const char* explain(ViewpointSource source);

const char* to_string(RegistrationStatus status);
const char* to_string(RegistrationReason reason);
/// @return one English sentence for messages.
const char* explain(RegistrationReason reason);

/// Counts after each stage of one pair; they show at which stage a pair failed. A hypothesis is a
/// quadruple of matches (RegistrationMethod::quadruples) or a seed
/// (RegistrationMethod::compatibility).
struct RegistrationStatistics {
  std::uint32_t source_points = 0;  ///< prepared points of the source
  std::uint32_t target_points = 0;
  /// Matches that hypotheses are made of; with seeds at most compatibility.max_matches.
  std::uint32_t correspondences = 0;
  std::uint64_t hypotheses = 0;  ///< quadruples drawn, or seeds tried
  /// Quadruples that passed the polygon test, at most quadruples.max_survivors; or seeds that gave
  /// a pose.
  std::uint64_t survivors = 0;
  std::uint64_t scored = 0;         ///< of these, those with a well-defined rigid fit
  std::uint32_t points_scored = 0;  ///< points that the inlier ratio is relative to
  /// Inliers of the returned pose under quadruples.max_normal_angle, by which it won; with seeds
  /// the same as inliers.
  std::uint32_t consensus = 0;
  /// Inliers of the inlier ratio: under quadruples.max_verification_normal_angle; with seeds under
  /// evidence.max_normal_angle.
  std::uint32_t inliers = 0;
  std::uint32_t refine_iterations = 0;  ///< of the returned pose
  /// The target was moved onto the source, being the smaller cloud.
  bool swapped = false;
};

/// Wall time of each stage in milliseconds. A chunk of pairs of a batch goes through a stage
/// together; then each pair carries its equal share, so that sums over pairs are right.
struct StageTimings {
  double match = 0;    ///< nearest features
  double propose = 0;  ///< hypotheses: seeds and their poses, or quadruples and their poses
  double rank = 0;     ///< coarse scores and distinct modes, or inlier counts of all hypotheses
  double refine = 0;   ///< ICP
  double verify = 0;   ///< evidence and degeneracy search, or the winner's support
  double total() const { return match + propose + rank + refine + verify; }
  StageTimings& operator+=(const StageTimings& more) {
    match += more.match;
    propose += more.propose;
    rank += more.rank;
    refine += more.refine;
    verify += more.verify;
    return *this;
  }
};

/// Counts and wall times (milliseconds) of the preparation of one cloud.
struct PrepareStatistics {
  std::uint64_t input_points = 0;
  std::uint64_t invalid_points = 0;  ///< dropped for NaN or infinite coordinates
  /// Dropped because they have fewer than two points within the normal radius; only in clouds
  /// with so many of them that they would exhaust the memory.
  std::uint64_t stray_points = 0;
  /// Left out because they lie at the smallest or the largest range of the sensor, not on a surface
  /// (gpureg/preparation/sensor_fixed.hpp, PrepareOptions::keep_range_limits).
  std::uint64_t range_limit_points = 0;
  double smallest_range = 0;                ///< of those of them near the sensor; 0: none, or there
  double largest_range = 0;                 ///< of those of them far from it; 0: none
  std::uint32_t points = 0;                 ///< after downsampling
  std::uint32_t points_without_normal = 0;  ///< fewer than 3 neighbours
  /// No neighbour within the feature radius, or no normal: never matched.
  std::uint32_t points_without_feature = 0;
  ViewpointSource viewpoint = ViewpointSource::given;
  /// Prepared points whose input normal contradicted the normals around it and was flipped.
  std::uint32_t repaired_normals = 0;
  /// A scan of a 2-D scanner: its points lie in a plane and form curves. It was prepared in layers
  /// along the normal of the plane, and points counts all of them.
  bool flat = false;
  double downsample = 0, normals = 0, features = 0, grid = 0, depth_maps = 0, surface_sides = 0;
  double total() const {
    return downsample + normals + features + grid + depth_maps + surface_sides;
  }
};

}  // namespace gpureg
