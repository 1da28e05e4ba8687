// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "gpureg/statistics.hpp"

namespace gpureg {

/// Eigen::Isometry3d without alignment: Eigen aligns by the processor that a file is compiled for,
/// so with it a program built with -march=native would see another layout of results than the
/// library does.
using UnalignedIsometry3d = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::DontAlign>;

/// What stands where there is no pose: NaN, which nobody takes for one.
inline UnalignedIsometry3d no_pose() {
  UnalignedIsometry3d pose;
  pose.matrix().setConstant(std::numeric_limits<double>::quiet_NaN());
  return pose;
}

/// Moments of the points that take part in correspondences: what both information-matrix
/// conventions are made of.
struct CorrespondenceMoments {
  std::uint64_t count = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();    ///< sum of p
  Eigen::Matrix3d outer = Eigen::Matrix3d::Zero();  ///< sum of p p'

  /// Redwood's 6x6: translation first, rotation as quaternion vector (factor 2): sum of A'A, A = [I
  /// | 2 [p]x'] (Choi et al. 2015).
  Eigen::Matrix<double, 6, 6> information_redwood() const;
  /// Open3D's 6x6: rotation (angles) first, no factor 2.
  Eigen::Matrix<double, 6, 6> information_open3d() const;
};

/// What speaks for and against a pose of Proposal::compatibility. Shares are in [0, 1]. "balanced":
/// points weigh less where many normals point their way, so that a floor does not outvote what
/// stands on it.
struct PoseEvidence {
  std::uint32_t match_inliers = 0;  ///< matches brought together
  /// the same as a balanced share of all matches, the smaller one of both sides
  double match_support = 0;
  /// points of the source with a target point in reach and normals alike
  double source_overlap = 0;
  double target_overlap = 0;  ///< and the other way round
  double source_reach = 0;    ///< the same whatever the normals
  double target_reach = 0;
  /// RMS distance of the overlapping points over max_correspondence_distance
  double source_residual = 1;
  double target_residual = 1;
  double source_balanced_overlap = 0;
  double target_balanced_overlap = 0;
  /// Points of the source in directions that the target's viewpoints saw, each counted as the
  /// squared cosine at which its surface would face them; 0: none known.
  double source_seen = 0;
  double target_seen = 0;
  /// of these (counted so), the share that hangs in space that was seen to be free
  double source_impossible = 0;
  double target_impossible = 0;
  /// of the points in such directions, the share behind what was seen
  double source_hidden = 0;
  double target_hidden = 0;
  /// Points of the source around the target's surfaces (up to prepare.front_reach); 0: not known.
  double source_around = 0;
  double target_around = 0;
  /// Points of the source in front of a surface of the target, on the side that its normals point
  /// to, without touching any: within half of the reach, and beyond. Whoever saw that surface
  /// should have seen them.
  double source_near_front = 0;
  double target_near_front = 0;
  double source_far_front = 0;
  double target_far_front = 0;
  double source_at_back = 0;  ///< behind one, and in front of none
  double target_at_back = 0;
  /// Eigenvalues, ascending, of the point-to-plane information of the source's inliers about their
  /// centre (rotation and translation, lengths in units of 20 voxels): a small one is a direction
  /// in which the pose slides.
  std::array<double, 6> stiffness{};
  /// The direction of the first of them, in the target's frame: rotation (x, y, z), then
  /// translation, a unit vector. A corridor slides along its last three.
  std::array<double, 6> softest{};
};

/// One of the distinct poses of a pair.
struct RegistrationMode {
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  double confidence = 0;  ///< probability that the pose is right
  /// probability that the pose is right and that the clouds overlap by 30 % or more
  double overlap_confidence = 0;
  PoseEvidence evidence;
  /// place among the modes before refinement, the most promising first
  std::uint32_t found_as = 0;
};

/// Result of one pair. A plain value.
struct RegistrationResult {
  RegistrationStatus status = RegistrationStatus::skipped;
  RegistrationReason reason = RegistrationReason::cancelled;
  bool has_candidate = false;  ///< target_from_source holds a pose, reported or not
  /// Moves the source's points into the target's frame: p_target = target_from_source * p_source.
  /// Converts to Eigen::Isometry3d. NaN without a candidate.
  UnalignedIsometry3d target_from_source = no_pose();
  /// what ranks results: the confidence; the inlier ratio with Proposal::quadruples
  double score = 0;
  double inlier_ratio = 0;  ///< inliers (judged) / points scored, [0, 1]
  double inlier_rmse = 0;   ///< metres, over the inliers
  /// of all correspondences within the distance, whatever their normals: points of the source, in
  /// its frame (Redwood's convention)
  CorrespondenceMoments source_moments;
  /// the same, points of the target, in its frame (Open3D's convention)
  CorrespondenceMoments target_moments;
  /// Distinct poses, the most confident first; the first is target_from_source. Empty with
  /// Proposal::quadruples.
  std::vector<RegistrationMode> modes;
  RegistrationStatistics statistics;
  StageTimings timings;

  bool aligned() const { return status == RegistrationStatus::aligned; }
};

}  // namespace gpureg
