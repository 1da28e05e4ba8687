// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/options.hpp"
#include "settings/settings.hpp"

/// For RegistrationOptions::tune and for validation; settings.hpp says what they are.
namespace gpureg::fields {

template <>
struct Fields<PrepareSettings> {
  static constexpr const char* kName = "PrepareSettings";
  static constexpr const char* kGroup = "prepare.";
  static constexpr const char* kSentence = "";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = PrepareSettings;
    v(&O::voxel_size, {"voxel_size", kLengthOrZero});
    v(&O::unit, {"unit", kLength});
    v(&O::normal_radius, {"normal_radius", kLength});
    v(&O::feature_radius, {"feature_radius", kLength});
    v(&O::wide_feature_radius, {"wide_feature_radius", kLengthOrZero});
    v(&O::max_correspondence_distance, {"max_correspondence_distance", kLength});
    v(&O::depth_maps, {"depth_maps", from(0, limits::kMaxDepthMaps)});
    v(&O::surface_side_distance, {"surface_side_distance", kLengthOrZero});
    v(&O::keep_range_limits, {"keep_range_limits"});
  }
  // clang-format on
};

template <>
struct Fields<QuadrupleSettings> {
  static constexpr const char* kName = "QuadrupleSettings";
  static constexpr const char* kGroup = "quadruples.";
  static constexpr const char* kSentence = "";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = QuadrupleSettings;
    v(&O::count, {"count", from(1, limits::kMaxQuadruples, "1 to 2^30")});
    v(&O::neighbors, {"neighbors", from(1, limits::kMaxNeighbors)});
    v(&O::mutual, {"mutual"});
    v(&O::edge_similarity, {"edge_similarity", kPositiveRatio});
    v(&O::max_survivors, {"max_survivors", from(1, limits::kMaxSurvivors, "1 to 2^22")});
    v(&O::max_normal_angle, {"max_normal_angle", kDegrees});
    v(&O::max_verification_normal_angle, {"max_verification_normal_angle", kDegrees});
    v(&O::min_inlier_ratio, {"min_inlier_ratio", kRatio});
  }
  // clang-format on
};

template <>
struct Fields<RefineSettings> {
  static constexpr const char* kName = "RefineSettings";
  static constexpr const char* kGroup = "refine.";
  static constexpr const char* kSentence = "";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = RefineSettings;
    v(&O::max_iterations, {"max_iterations", from(0, limits::kMaxIterations)});
    v(&O::kernel_width, {"kernel_width", kLength});
  }
  // clang-format on
};

template <>
struct Fields<CompatibilitySettings> {
  static constexpr const char* kName = "CompatibilitySettings";
  static constexpr const char* kGroup = "compatibility.";
  static constexpr const char* kSentence = "";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = CompatibilitySettings;
    v(&O::max_matches, {"max_matches", from(limits::kMinMatches, limits::kMaxMatches)});
    v(&O::seeds, {"seeds", from(1, limits::kMaxSeeds)});
    v(&O::max_members, {"max_members", from(limits::kMinMembers, limits::kMaxMembers)});
    v(&O::triangles, {"triangles", from(1, limits::kMaxTriangles)});
    v(&O::refits, {"refits", from(1, limits::kMaxRefits)});
    v(&O::tolerance, {"tolerance", kLength});
    v(&O::max_turn, {"max_turn", above(0, 2, "a difference of cosines in (0, 2]")});
    v(&O::consensus_distance, {"consensus_distance", kLength});
    v(&O::seed_separation, {"seed_separation", kLength});
  }
  // clang-format on
};

template <>
struct Fields<EvidenceSettings> {
  static constexpr const char* kName = "EvidenceSettings";
  static constexpr const char* kGroup = "evidence.";
  static constexpr const char* kSentence = "";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = EvidenceSettings;
    v(&O::sample, {"sample", from(limits::kMinSample, limits::kMaxSample)});
    v(&O::modes, {"modes", from(1, limits::kMaxModes)});
    v(&O::max_normal_angle, {"max_normal_angle", kDegrees});
    v(&O::mode_angle, {"mode_angle", kDegrees});
    v(&O::mode_distance, {"mode_distance", kLength});
    v(&O::degeneracy_search_distance, {"degeneracy_search_distance", kLengthOrZero});
    v(&O::free_space_margin, {"free_space_margin", kLength});
    v(&O::min_range, {"min_range", kLength});
  }
  // clang-format on
};

template <>
struct Fields<RegistrationSettings> {
  static constexpr const char* kName = "RegistrationSettings";
  static constexpr const char* kGroup = "";
  static constexpr const char* kSentence = "";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using O = RegistrationSettings;
    v(&O::seed, {"seed"});
    v(&O::min_confidence, {"min_confidence", kProbability});
    v(&O::accept_symmetry, {"accept_symmetry"});
    v(&O::calibration, {"calibration"});
    v(&O::method, {"method"});
    v(&O::smaller_as_source, {"smaller_as_source"});
    v(&O::prepare, {"prepare"});
    v(&O::quadruples, {"quadruples"});
    v(&O::refine, {"refine"});
    v(&O::compatibility, {"compatibility"});
    v(&O::evidence, {"evidence"});
  }
  // clang-format on
};

}  // namespace gpureg::fields
