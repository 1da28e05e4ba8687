// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

namespace gpureg {

/// Evidence for and against a pose (RegistrationMethod::compatibility). Shares are in [0, 1]. Each
/// share exists for both sides: `source_*` counts points of the source moved into the target,
/// `target_*` points of the target moved into the source.
struct PoseEvidence {
  std::uint32_t match_inliers = 0;  ///< matches that the pose brings within consensus_distance
  /// The same as a normal-weighted share of all matches, the smaller one of both sides.
  double match_support = 0;
  /// Share of the points with a point of the other cloud within max_correspondence_distance whose
  /// normal is within EvidenceOptions::max_normal_angle.
  double source_overlap = 0;
  double target_overlap = 0;
  double source_overlap_any_normal = 0;  ///< the same whatever the normals
  double target_overlap_any_normal = 0;
  /// RMS distance of the overlapping points over max_correspondence_distance; 1 where there are
  /// none.
  double source_residual = 1;
  double target_residual = 1;
  /// Overlap with normal-space weights (after Rusinkiewicz and Levoy 2001): the weight of a point
  /// decreases with the number of normals of its cloud in its direction. Floors do not dominate
  /// furniture.
  double source_normal_weighted_overlap = 0;
  double target_normal_weighted_overlap = 0;
  /// Share of the points in directions that viewpoints of the other cloud observed, each weighted
  /// by its incidence (squared cosine between normal and line of sight); 0: no viewpoint known.
  double source_observed = 0;
  double target_observed = 0;
  /// Of these, with the same weights, the share that lies in observed free space.
  double source_free_space_violation = 0;
  double target_free_space_violation = 0;
  /// Of the points in observed directions, the share behind the observed surface.
  double source_occluded = 0;
  double target_occluded = 0;
  /// Share of the points within prepare.surface_side_distance of the other cloud's surfaces; 0: not
  /// known.
  double source_near_surface = 0;
  double target_near_surface = 0;
  /// Share of the points in front of a surface of the other cloud, on the side that its normals
  /// point to, without touching any: within half of surface_side_distance (near), and beyond (far).
  /// The sensor that observed this surface should have observed them.
  double source_front_violation_near = 0;
  double target_front_violation_near = 0;
  double source_front_violation_far = 0;
  double target_front_violation_far = 0;
  double source_behind_surface = 0;  ///< share behind a surface and in front of none
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
