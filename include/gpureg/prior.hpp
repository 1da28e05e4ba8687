// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gpureg/result.hpp"

/// What is known of a pair before it is aligned.
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

/// One correspondence: indices into PreparedCloud::points() of source and target.
struct Correspondence {
  std::uint32_t source;
  std::uint32_t target;
};

/// What is known of one pair. Candidates that contradict gravity or pose rank last, and refined
/// poses that contradict them are dropped; if no pose remains, the pair is not aligned, with
/// RegistrationReason::contradicts_prior. Both need RegistrationMethod::compatibility. An empty
/// prior changes no bit of the result.
struct RegistrationPrior {
  std::optional<GravityPrior> gravity = std::nullopt;
  std::optional<PosePrior> pose = std::nullopt;
  /// Take the place of feature matches: any number, in any order.
  std::optional<std::vector<Correspondence>> correspondences = std::nullopt;

  bool empty() const { return !gravity && !pose && !correspondences; }
  /// @param name prefix of the field in error messages.
  /// @throws InvalidArgument naming field and value.
  void validate(const std::string& name = "prior") const;
};

}  // namespace gpureg
