// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pose_graph/se3.hpp"

namespace gpureg::pose_graph {

/// A relative pose with the covariance of its right perturbation.
struct UncertainPose {
  Pose pose;
  Matrix6d covariance = Matrix6d::Zero();

  /// First order (Barfoot and Furgale 2014).
  UncertainPose operator*(const UncertainPose& next) const;
  UncertainPose inverse() const;
};

/// The covariance of an information matrix; what it does not constrain gets a large variance.
Matrix6d covariance_of(const Matrix6d& information);

}  // namespace gpureg::pose_graph
