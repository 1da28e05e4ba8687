// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

namespace gpureg {

/// Evidence for and against a pose (RegistrationMethod::compatibility). `source_*`: of the points p
/// of the source, moved by the pose into the other cloud, the target; `target_*`: roles exchanged.
/// N: their number. `near(p)`: the nearest point of the other cloud is within
/// max_correspondence_distance; d(p): that distance. `fits(p)`: near, and the normals differ by at
/// most 30 degrees.
/// `sum(a : b)`: of a over the points with b.
struct PoseEvidence {
  std::uint32_t match_inliers = 0;  ///< number of matches within consensus_distance at the pose
  /// `sum(w : match inlier) / sum(w)` over all matches; the smaller one of both sides. w as below.
  double match_support = 0;
  double source_overlap = 0;  ///< `sum(1 : fits) / N`
  double target_overlap = 0;
  double source_overlap_any_normal = 0;  ///< `sum(1 : near) / N`
  double target_overlap_any_normal = 0;
  /// `sqrt(sum(d^2 : fits) / sum(1 : fits)) / max_correspondence_distance`; 1 if no point fits.
  double source_residual = 1;
  double target_residual = 1;
  /// `sum(w : fits) / sum(w)`. w(p): normal-space weight (Rusinkiewicz and Levoy 2001), smaller the
  /// more normals of the cloud have the direction of that of p: floors do not dominate furniture.
  double source_normal_weighted_overlap = 0;
  double target_normal_weighted_overlap = 0;
  /// `sum(c : observed) / N`. observed(p): a viewpoint of the other cloud observed a surface in the
  /// direction of p. c(p): incidence, the squared cosine between normal and line of sight.
  /// 0: no viewpoint is known.
  double source_observed = 0;
  double target_observed = 0;
  /// `sum(c : observed and in free space and not near) / sum(c : observed)`
  double source_free_space_violation = 0;
  double target_free_space_violation = 0;
  /// `sum(1 : behind every surface observed in its direction, not near) / sum(1 : observed)`
  double source_occluded = 0;
  double target_occluded = 0;
  /// `sum(1 : within surface_side_distance of a surface of the other cloud) / N`; 0: not known.
  double source_near_surface = 0;
  double target_near_surface = 0;
  /// `sum(1 : in front of a surface, touching none) / N`, within half of surface_side_distance
  /// (near) or beyond (far). In front: on the side to which its normals point.
  /// The sensor that observed the surface should have observed such a point.
  double source_front_violation_near = 0;
  double target_front_violation_near = 0;
  double source_front_violation_far = 0;
  double target_front_violation_far = 0;
  /// `sum(1 : behind a surface, in front of none, touching none) / N`
  double source_behind_surface = 0;
  double target_behind_surface = 0;
  /// Eigenvalues, ascending, of the point-to-plane information of the source's inliers about their
  /// centre (rotation and translation, lengths in units of 20 voxels). A small first one means that
  /// the geometry hardly holds the pose in weakest_direction.
  std::array<double, 6> information_eigenvalues{};
  /// Eigenvector of the first eigenvalue, in the target's frame: rotation (x, y, z), then
  /// translation, a unit vector. In a corridor its last three elements point along the corridor.
  std::array<double, 6> weakest_direction{};
};

}  // namespace gpureg
