// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/uncertain_pose.hpp"

#include <Eigen/Cholesky>

namespace gpureg::pose_graph {
namespace {

/// Variance, as a multiple of the smallest one, of what an information matrix leaves free.
constexpr double kRegularisation = 1e-9;

}  // namespace

UncertainPose UncertainPose::operator*(const UncertainPose& next) const {
  const Matrix6d a = adjoint(next.pose.inverse());
  return {pose * next.pose, a * covariance * a.transpose() + next.covariance};
}

UncertainPose UncertainPose::inverse() const {
  const Matrix6d a = adjoint(pose);
  return {pose.inverse(), a * covariance * a.transpose()};
}

Matrix6d covariance_of(const Matrix6d& information) {
  Matrix6d regular = information;
  regular.diagonal().array() += kRegularisation * information.diagonal().maxCoeff();
  return regular.llt().solve(Matrix6d::Identity());
}

}  // namespace gpureg::pose_graph
