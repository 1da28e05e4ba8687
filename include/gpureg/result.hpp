// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

#include "gpureg/statistics.hpp"

namespace gpureg {

/// Eigen::Isometry3d without alignment: Eigen aligns by the processor that a file is compiled for, so with it a program built with
/// -march=native would see another layout of results than the library does.
using UnalignedIsometry3d = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::DontAlign>;

/// Moments of the points that take part in correspondences: what both information-matrix conventions are made of.
struct CorrespondenceMoments {
  std::uint64_t count = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();        ///< sum of p
  Eigen::Matrix3d outer = Eigen::Matrix3d::Zero();      ///< sum of p p'

  /// Redwood's 6x6: translation first, rotation as quaternion vector (factor 2): sum of A'A, A = [I | 2 [p]x'] (Choi et al. 2015).
  Eigen::Matrix<double, 6, 6> information_redwood() const;
  /// Open3D's 6x6: rotation (angles) first, no factor 2.
  Eigen::Matrix<double, 6, 6> information_open3d() const;
};

/// Result of one pair. A plain value.
struct RegistrationResult {
  RegistrationStatus status = RegistrationStatus::skipped;
  RegistrationReason reason = RegistrationReason::cancelled;
  bool has_candidate = false;  ///< target_from_source holds a pose, reported or not
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();  ///< converts to Eigen::Isometry3d
  double score = 0;            ///< what ranks results: today the inlier ratio
  double inlier_ratio = 0;     ///< inliers (judged) / points scored, [0, 1]
  double inlier_rmse = 0;      ///< metres, over the inliers
  CorrespondenceMoments source_moments;  ///< of all correspondences within the distance, whatever their normals: points of the source, in its frame (Redwood's convention)
  CorrespondenceMoments target_moments;  ///< the same, points of the target, in its frame (Open3D's convention)
  RegistrationStatistics statistics;
  StageTimings timings;

  bool aligned() const { return status == RegistrationStatus::aligned; }
};

}  // namespace gpureg
