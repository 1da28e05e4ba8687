// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "gpureg/result.hpp"

/// Prior knowledge of the pose of a pair.
namespace gpureg {

/// Vertical direction in both clouds, from an accelerometer for example. The rotation about the
/// vertical and the translation stay free.
struct GravityPrior {
  /// Up in the frame of the source, of any length but 0.
  Eigen::Vector3d source_up = Eigen::Vector3d::UnitZ();
  /// Up in the frame of the target, of any length but 0.
  Eigen::Vector3d target_up = Eigen::Vector3d::UnitZ();
  /// Largest angle between target_up and the rotated source_up, degrees, (0, 180].
  double max_angle = 10;
};

/// Approximate pose, from odometry for example.
struct PosePrior {
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  /// Largest rotation between the pose and target_from_source, degrees, (0, 180].
  double max_rotation = 30;
  /// Largest distance, metres, between the positions that the pose and target_from_source give the
  /// centre of the bounding box of the source.
  double max_translation = 1;
};

/// Constraints on the pose of one pair. Candidates that contradict them rank last, and refined
/// poses that contradict them are dropped. If no pose remains, the pair is not aligned, with
/// RegistrationReason::contradicts_prior. An empty prior changes no bit of the result.
struct RegistrationPrior {
  std::optional<GravityPrior> gravity;
  std::optional<PosePrior> pose;

  bool empty() const { return !gravity && !pose; }
  /// @param name prefix of the field in error messages.
  /// @throws InvalidArgument naming field and value.
  void validate(const std::string& name = "prior") const;
};

}  // namespace gpureg
