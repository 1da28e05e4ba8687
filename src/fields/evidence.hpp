// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fields/field.hpp"
#include "gpureg/evidence.hpp"

namespace gpureg::fields {

template <>
struct Fields<PoseEvidence> {
  static constexpr const char* kName = "PoseEvidence";
  static constexpr const char* kSentence =
      "Evidence for and against a pose (method 'compatibility').";

  // clang-format off: a field is a line.
  template <typename V>
  static void visit(V&& v) {
    using E = PoseEvidence;
    v(&E::match_inliers, {"match_inliers", "Matches that the pose brings within consensus_distance."});
    v(&E::match_support, {"match_support", "The same as a normal-weighted share of all matches, the smaller one of both sides."});
    v(&E::source_overlap, &E::target_overlap, {"overlap", "Share of the source's points with a point of the target within max_correspondence_distance and a similar normal."});
    v(&E::source_overlap_any_normal, &E::target_overlap_any_normal, {"overlap_any_normal", "The same whatever the normals."});
    v(&E::source_residual, &E::target_residual, {"residual", "RMS distance of the overlapping points over max_correspondence_distance; 1 if there are none."});
    v(&E::source_normal_weighted_overlap, &E::target_normal_weighted_overlap, {"normal_weighted_overlap", "Overlap in which a point weighs less the more normals of its cloud share its direction."});
    v(&E::source_observed, &E::target_observed, {"observed", "Share of the source's points in directions that viewpoints of the target observed, weighted by incidence; 0: no viewpoint known."});
    v(&E::source_free_space_violation, &E::target_free_space_violation, {"free_space_violation", "Of these, with the same weights, the share in observed free space."});
    v(&E::source_occluded, &E::target_occluded, {"occluded", "Of the points in observed directions, the share behind the observed surface."});
    v(&E::source_near_surface, &E::target_near_surface, {"near_surface", "Share of the source's points within surface_side_distance of the target's surfaces; 0: not known."});
    v(&E::source_front_violation_near, &E::target_front_violation_near, {"front_violation_near", "Share of the source's points that are in front of a surface of the target without touching any, within half of surface_side_distance."});
    v(&E::source_front_violation_far, &E::target_front_violation_far, {"front_violation_far", "The same, beyond half of surface_side_distance."});
    v(&E::source_behind_surface, &E::target_behind_surface, {"behind_surface", "Share of the source's points behind a surface of the target and in front of none."});
    v(&E::information_eigenvalues, {"information_eigenvalues", "6 eigenvalues, ascending, of the point-to-plane information. A small first one means that the geometry hardly holds the pose in weakest_direction."});
    v(&E::weakest_direction, {"weakest_direction", "Eigenvector of the first eigenvalue, in the target's frame: rotation, then translation."});
  }
  // clang-format on
};

}  // namespace gpureg::fields
