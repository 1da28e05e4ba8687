// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "gpureg/result.hpp"

/// What is known of a pair's pose before it is looked for.
namespace gpureg {

/// Which way is up in both clouds, from an accelerometer, say. Leaves the turn about the vertical
/// and the translation free.
struct GravityPrior {
  Eigen::Vector3d source_up =
      Eigen::Vector3d::UnitZ();  ///< in the source's frame, any length but 0
  Eigen::Vector3d target_up = Eigen::Vector3d::UnitZ();  ///< in the target's frame
  double max_angle =
      10;  ///< degrees between the target's up and the source's, turned by the pose, (0, 180]
};

/// Roughly where the source is, from odometry, say.
struct PosePrior {
  UnalignedIsometry3d target_from_source = UnalignedIsometry3d::Identity();
  double max_rotation = 30;  ///< degrees that the pose may be turned from it, (0, 180]
  /// metres that the middle of the source's bounding box may be shifted from where it puts it
  double max_translation = 1;
};

/// What a pose of one pair must not contradict. Candidates that do are considered last, and refined
/// poses that do are dropped; where none is left, the pair is not aligned for
/// RegistrationReason::contradicts_prior. Without any part nothing changes, not a bit.
struct RegistrationPrior {
  std::optional<GravityPrior> gravity;
  std::optional<PosePrior> pose;

  bool empty() const { return !gravity && !pose; }
  /// Throws InvalidArgument naming the field, after `name`, and its value.
  void validate(const std::string& name = "prior") const;
};

}  // namespace gpureg
