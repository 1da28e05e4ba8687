// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "gpureg/evidence.hpp"
#include "gpureg/statistics.hpp"

namespace gpureg {

/// Eigen::Isometry3d without alignment: Eigen aligns by the processor that a file is compiled for,
/// so with it a program built with -march=native would see another layout of results than the
/// library does.
using UnalignedIsometry3d = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::DontAlign>;

/// The value of a pose that does not exist: NaN in every element.
inline UnalignedIsometry3d no_pose() {
  UnalignedIsometry3d pose;
  pose.matrix().setConstant(std::numeric_limits<double>::quiet_NaN());
  return pose;
}

/// Moments of the points of correspondences, from which information matrices of both conventions
/// follow.
struct CorrespondenceMoments {
  std::uint64_t count = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();    ///< sum of p
  Eigen::Matrix3d outer = Eigen::Matrix3d::Zero();  ///< sum of p p'

  /// Redwood's 6x6: translation first, rotation as quaternion vector (factor 2): sum of A'A, A = [I
  /// | 2 [p]x'] (Choi et al. 2015).
  Eigen::Matrix<double, 6, 6> information_redwood() const;
  /// Its inverse, for results that were read from a file.
  static CorrespondenceMoments from_redwood(const Eigen::Matrix<double, 6, 6>& information);
  /// Open3D's 6x6: rotation (angles) first, no factor 2.
  Eigen::Matrix<double, 6, 6> information_open3d() const;
};

/// One of the distinct poses of a pair.
struct RegistrationMode {
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  double confidence = 0;  ///< probability that the pose is correct
  /// Probability that the pose is correct and the clouds overlap by 30 % or more.
  double overlap_confidence = 0;
  PoseEvidence evidence;
  /// Rank by the coarse score among the modes after the first refinement, from 0.
  std::uint32_t rank_before_refinement = 0;
  /// The clouds cannot tell this pose from the first one: a symmetry of the larger cloud lies
  /// between them, and the odds of both are similar. False for the first pose itself.
  bool equivalent = false;
};

/// Result of one pair. A plain value.
struct RegistrationResult {
  RegistrationStatus status = RegistrationStatus::skipped;
  RegistrationReason reason = RegistrationReason::cancelled;
  /// Moves the source's points into the target's frame: p_target = target_from_source * p_source.
  /// Converts to Eigen::Isometry3d. The most confident pose, reported or not; NaN if there is none,
  /// and if it is not reported and brings no points together: has_pose().
  UnalignedIsometry3d target_from_source = no_pose();
  /// Probability that target_from_source is correct; with RegistrationMethod::quadruples the inlier
  /// ratio. What reaches RegistrationOptions::min_confidence is reported.
  double confidence = 0;
  double inlier_ratio = 0;  ///< verified inliers / points scored, [0, 1]
  double inlier_rmse = 0;   ///< over the inliers, in the unit of the points
  float voxel_size = 0;     ///< of the target's preparation; 0: the pair was not tried
  /// Moments of all correspondences within max_correspondence_distance, whatever their normals:
  /// points of the source, in its frame (Redwood's convention).
  CorrespondenceMoments source_moments;
  /// The same, points of the target, in its frame (Open3D's convention).
  CorrespondenceMoments target_moments;
  /// Distinct poses, the most confident first; the first is target_from_source. Empty with
  /// RegistrationMethod::quadruples.
  std::vector<RegistrationMode> modes;
  RegistrationStatistics statistics;
  /// Both clouds are scans of a 2-D scanner (PrepareStatistics::flat). All poses move the plane of
  /// the source onto that of the target, exactly; the moments are those of points in the planes.
  bool flat = false;
  /// What was known of the places that the clouds were seen from.
  ViewpointSource source_viewpoint = ViewpointSource::given;
  ViewpointSource target_viewpoint = ViewpointSource::given;
  StageTimings timings;

  /// True for aligned_up_to_symmetry, too.
  bool aligned() const {
    return status == RegistrationStatus::aligned ||
           status == RegistrationStatus::aligned_up_to_symmetry;
  }
  /// target_from_source holds a pose, reported or not.
  bool has_pose() const { return !target_from_source.matrix().array().isNaN().all(); }
  /// Number of modes that the clouds cannot tell from the first one, with that one; 0 without
  /// modes.
  std::size_t equivalent_poses() const;
  /// Probability that the first mode or one of its equivalents is correct: the sum of their
  /// confidences. The confidence without modes.
  double symmetry_confidence() const;
};

/// The most telling reason why the first mode is not confident, by its evidence, the other modes
/// and the numbers of points. Does not read status, reason and confidence.
/// @return confidence_too_low if no single reason stands out.
RegistrationReason diagnose(const RegistrationResult& result);

/// @return result.reason with the numbers of this result: one English sentence without full stop.
std::string explain(const RegistrationResult& result);
/// @return what to try next, in the names of this API; "" if there is nothing.
const char* advice(RegistrationReason reason);

}  // namespace gpureg
