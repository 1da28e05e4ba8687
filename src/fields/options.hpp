// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/field.hpp"
#include "gpureg/options.hpp"

namespace gpureg::fields {

template <>
struct Values<RegistrationMethod> {
  static constexpr RegistrationMethod kAll[] = {RegistrationMethod::compatibility,
                                                RegistrationMethod::quadruples};
};

template <>
struct Fields<ConfidenceCalibration> {
  static constexpr const char* kName = "ConfidenceCalibration";
  static constexpr const char* kGroup = "calibration.";
  static constexpr const char* kSentence =
      "Confidence of another sensor: log odds = offset + slope * log odds. The default changes "
      "nothing.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using C = ConfidenceCalibration;
    v(&C::slope, {"slope", above(0, kMost, "a number > 0"), "Factor of the log odds."});
    v(&C::offset, {"offset", kFinite, "Added to the log odds."});
  }
  // clang-format on
};

template <>
struct Fields<PrepareOptions> {
  static constexpr const char* kName = "PrepareOptions";
  static constexpr const char* kGroup = "prepare.";
  static constexpr const char* kSentence = "How a raw cloud becomes a PreparedCloud.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = PrepareOptions;
    v(&O::voxel_size, {"voxel_size", kLengthOrZero, voxels(1), "Edge of the downsampling voxel; 0 keeps the points as they are."});
    v(&O::normal_radius, {"normal_radius", kLength, voxels(2), "Neighbourhood of a normal. Normals of the wide features use a radius that is larger by wide_feature_radius / feature_radius."});
    v(&O::feature_radius, {"feature_radius", kLength, voxels(5), "Neighbourhood of FPFH."});
    v(&O::wide_feature_radius, {"wide_feature_radius", kLengthOrZero, voxels(8), "Neighbourhood of a second FPFH; 0: none."});
    v(&O::max_correspondence_distance, {"max_correspondence_distance", kLength, voxels(1.5f), "Largest distance of an inlier and of a correspondence of the refinement. An alignment may use a smaller one than its clouds were prepared with, never a larger one."});
    v(&O::depth_maps, {"depth_maps", from(0, limits::kMaxDepthMaps), "Viewpoints that get a depth map for free-space tests; 0: none, and given normals are never flipped."});
    v(&O::surface_side_distance, {"surface_side_distance", kLengthOrZero, voxels(10), "Range in front of and behind its surfaces within which a cloud tells the two sides apart; 0: no such evidence."});
    v(&O::keep_range_limits, {"keep_range_limits", "Keep points at the smallest and the largest range of the sensor, which are fixed to it: for a tank scanned from its centre."});
  }
  // clang-format on
};

template <>
struct Fields<QuadrupleOptions> {
  static constexpr const char* kName = "QuadrupleOptions";
  static constexpr const char* kGroup = "quadruples.";
  static constexpr const char* kSentence =
      "The paper's hypotheses (method 'quadruples'): uniform quadruples of feature matches, scored "
      "by their inliers.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = QuadrupleOptions;
    v(&O::count, {"count", from(1, limits::kMaxQuadruples, "1 to 2^30"), "Quadruples drawn per pair; fewer are faster and lose pairs with little overlap."});
    v(&O::neighbors, {"neighbors", from(1, limits::kMaxNeighbors), "Nearest features kept per source point."});
    v(&O::mutual, {"mutual", "Keep only matches that are nearest in both directions."});
    v(&O::edge_similarity, {"edge_similarity", kPositiveRatio, "Smallest ratio between corresponding sides in the polygon test."});
    v(&O::max_survivors, {"max_survivors", from(1, limits::kMaxSurvivors, "1 to 2^22"), "Quadruples scored per pair at most; 2^18 scores all of them, as the paper does."});
    v(&O::max_normal_angle, {"max_normal_angle", kDegrees, "Between the normals of an inlier while hypotheses are compared; 180: no test."});
    v(&O::max_verification_normal_angle, {"max_verification_normal_angle", kDegrees, "The same while the winner is verified."});
    v(&O::min_inlier_ratio, {"min_inlier_ratio", kRatio, "Verified inlier ratio below which no alignment is reported."});
  }
  // clang-format on
};

template <>
struct Fields<RefineOptions> {
  static constexpr const char* kName = "RefineOptions";
  static constexpr const char* kGroup = "refine.";
  static constexpr const char* kSentence =
      "Robust point-to-plane ICP that refines the winning hypothesis, or every mode.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = RefineOptions;
    v(&O::max_iterations, {"max_iterations", from(0, limits::kMaxIterations), "Iterations at most; 0 switches the refinement off."});
    v(&O::kernel_width, {"kernel_width", kLength, voxels(0.5f), "Width of the Geman-McClure kernel."});
  }
  // clang-format on
};

template <>
struct Fields<CompatibilityOptions> {
  static constexpr const char* kName = "CompatibilityOptions";
  static constexpr const char* kGroup = "compatibility.";
  static constexpr const char* kSentence =
      "Candidate poses from matches that keep each other's distances and angles (method "
      "'compatibility').";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = CompatibilityOptions;
    v(&O::max_matches, {"max_matches", from(limits::kMinMatches, limits::kMaxMatches), "Matches kept per pair."});
    v(&O::seeds, {"seeds", from(1, limits::kMaxSeeds), "Matches whose neighbourhoods become candidates."});
    v(&O::max_members, {"max_members", from(limits::kMinMembers, limits::kMaxMembers), "Compatible matches of a seed that take part."});
    v(&O::triangles, {"triangles", from(1, limits::kMaxTriangles), "Triangles tried per seed."});
    v(&O::refits, {"refits", from(1, limits::kMaxRefits), "Least-squares fits to the consensus set of the best triangle."});
    v(&O::tolerance, {"tolerance", kLength, voxels(1), "Largest difference of distances between compatible matches."});
    v(&O::max_turn, {"max_turn", above(0, 2, "a difference of cosines in (0, 2]"), "Largest difference of the cosines between their normals; 2: no test."});
    v(&O::consensus_distance, {"consensus_distance", kLength, voxels(2), "Distance within which a pose brings a match together."});
    v(&O::seed_separation, {"seed_separation", kLength, voxels(2), "Distance around a seed without a weaker seed; shortest side of a triangle."});
  }
  // clang-format on
};

template <>
struct Fields<EvidenceOptions> {
  static constexpr const char* kName = "EvidenceOptions";
  static constexpr const char* kGroup = "evidence.";
  static constexpr const char* kSentence =
      "How candidates are scored and verified (method 'compatibility'): support by matches, "
      "overlap of both clouds, free space.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = EvidenceOptions;
    v(&O::sample, {"sample", from(limits::kMinSample, limits::kMaxSample), "Approximate number of points of each cloud that score a candidate."});
    v(&O::modes, {"modes", from(1, limits::kMaxModes), "Distinct poses that are refined and verified by all points."});
    v(&O::max_normal_angle, {"max_normal_angle", kDegrees, "Between the normals of an inlier."});
    v(&O::mode_angle, {"mode_angle", kDegrees, "Two poses are one mode if their rotations differ by less than this ..."});
    v(&O::mode_distance, {"mode_distance", kLength, voxels(6), "... and the cloud's centre by less than this."});
    v(&O::degeneracy_search_distance, {"degeneracy_search_distance", kLengthOrZero, voxels(8), "Range of the degeneracy search: the most likely mode is perturbed along its weakest direction by up to this far, both ways; 0: no search."});
    v(&O::free_space_margin, {"free_space_margin", kLength, voxels(12, 5), "Distance in front of an observed surface within which a point does not violate free space."});
    v(&O::min_range, {"min_range", kLength, voxels(6), "Distance from a viewpoint below which nothing counts as observed."});
  }
  // clang-format on
};

template <>
struct Fields<RegistrationOptions> {
  static constexpr const char* kName = "RegistrationOptions";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence = "All options of one registration.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = RegistrationOptions;
    v(&O::seed, {"seed", "Same seed, same bits, on any backend and number of threads."});
    v(&O::min_confidence, {"min_confidence", kProbability, "Confidence below which no alignment is reported (method 'compatibility')."});
    v(&O::accept_symmetry, {"accept_symmetry", "Report one of several poses that a symmetry of the larger cloud makes equivalent if their common confidence reaches min_confidence (method 'compatibility')."});
    v(&O::calibration, {"calibration", "Scales every confidence to a sensor (method 'compatibility')."});
    v(&O::method, {"method", "How candidate poses are found: second-order compatibility (SC2-PCR), or LoopSmart quadruples."});
    v(&O::smaller_as_source, {"smaller_as_source", "Move the cloud with fewer points. Results are of the given source and target either way."});
    v(&O::prepare, {"prepare", "How a raw cloud is prepared."});
    v(&O::quadruples, {"quadruples", "Hypotheses of the method 'quadruples'."});
    v(&O::refine, {"refine", "How poses are refined."});
    v(&O::compatibility, {"compatibility", "Candidates of the method 'compatibility'."});
    v(&O::evidence, {"evidence", "How the method 'compatibility' scores and verifies candidates."});
  }
  // clang-format on
};

}  // namespace gpureg::fields
