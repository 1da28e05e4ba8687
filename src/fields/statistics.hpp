// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/field.hpp"
#include "gpureg/statistics.hpp"

namespace gpureg::fields {

template <>
struct Values<ViewpointSource> {
  static constexpr ViewpointSource kAll[] = {ViewpointSource::given, ViewpointSource::origin,
                                             ViewpointSource::normals, ViewpointSource::none,
                                             ViewpointSource::model};
};

template <>
struct Fields<RegistrationStatistics> {
  static constexpr const char* kName = "RegistrationStatistics";
  static constexpr const char* kSentence = "What was left after each stage of one pair.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using S = RegistrationStatistics;
    v(&S::source_points, {"source_points", "Prepared points of the source."});
    v(&S::target_points, {"target_points", "Prepared points of the target."});
    v(&S::correspondences, {"correspondences", "Matches that hypotheses are made of."});
    v(&S::hypotheses, {"hypotheses", "Quadruples drawn, or seeds tried."});
    v(&S::survivors, {"survivors", "Quadruples that passed the polygon test, or seeds that gave a pose."});
    v(&S::scored, {"scored", "Of these, those with a well-defined rigid fit."});
    v(&S::points_scored, {"points_scored", "Points that the inlier ratio is relative to."});
    v(&S::consensus, {"consensus", "Inliers by which the returned pose won."});
    v(&S::inliers, {"inliers", "Inliers of the inlier ratio."});
    v(&S::refine_iterations, {"refine_iterations", "Iterations of the refinement of the returned pose."});
    v(&S::swapped, {"swapped", "The target was moved onto the source, being the smaller cloud (smaller_as_source)."});
  }
  // clang-format on
};

template <>
struct Fields<StageTimings> {
  static constexpr const char* kName = "StageTimings";
  static constexpr const char* kSentence = "Wall time of each stage of one pair, milliseconds.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using T = StageTimings;
    v(&T::match, {"match", kMilliseconds, "Nearest features."});
    v(&T::propose, {"propose", kMilliseconds, "Seeds and their poses, or quadruples and their poses."});
    v(&T::rank, {"rank", kMilliseconds, "Coarse scores and distinct modes, or inlier counts of all hypotheses."});
    v(&T::refine, {"refine", kMilliseconds, "ICP."});
    v(&T::verify, {"verify", kMilliseconds, "Evidence and degeneracy search, or the winner's support."});
  }
  // clang-format on
};

template <>
struct Fields<PrepareStatistics> {
  static constexpr const char* kName = "PrepareStatistics";
  static constexpr const char* kSentence =
      "Counts and wall times (milliseconds) of the preparation of one cloud.";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using P = PrepareStatistics;
    v(&P::input_points, {"input_points", "Points that came in."});
    v(&P::invalid_points, {"invalid_points", "Of these, dropped for NaN or infinity."});
    v(&P::stray_points, {"stray_points", "Dropped because they have fewer than two points within the normal radius; only in clouds with so many of them that they would exhaust the memory."});
    v(&P::range_limit_points, {"range_limit_points", "Left out because they lie at the smallest or the largest range of the sensor, not on a surface."});
    v(&P::smallest_range, {"smallest_range", "Of those of them near the sensor; 0: none, or at the sensor itself."});
    v(&P::largest_range, {"largest_range", "Of those of them far from the sensor; 0: none."});
    v(&P::points, {"points", "After downsampling."});
    v(&P::points_without_normal, {"points_without_normal", "Fewer than 3 neighbours."});
    v(&P::points_without_feature, {"points_without_feature", "Never matched."});
    v(&P::viewpoint, {"viewpoint", "What is known of the place that the cloud was seen from."});
    v(&P::repaired_normals, {"repaired_normals", "Prepared points whose input normal contradicted the normals around it."});
    v(&P::flat, {"flat", "A scan of a 2-D scanner, prepared in layers along the normal of its plane; points counts all of them."});
    v(&P::downsample, {"downsample", kMilliseconds, "Time of downsampling."});
    v(&P::normals, {"normals", kMilliseconds, "Time of the normals."});
    v(&P::features, {"features", kMilliseconds, "Time of the features."});
    v(&P::grid, {"grid", kMilliseconds, "Time of the search grid."});
    v(&P::depth_maps, {"depth_maps", kMilliseconds, "Time of the depth maps."});
    v(&P::surface_sides, {"surface_sides", kMilliseconds, "Time of the surfaces' sides."});
  }
  // clang-format on
};

}  // namespace gpureg::fields
