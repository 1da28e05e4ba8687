// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

/// The group SE(3) with rotation-first tangent vectors (omega, v) and right perturbations T Exp(x).
/// Source: Barfoot, "State Estimation for Robotics", 2017, sections 7.1.3 to 7.1.5.
namespace gpureg::pose_graph {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// world_from_node and the like.
struct Pose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Pose operator*(const Pose& other) const {
    return {rotation * other.rotation, rotation * other.translation + translation};
  }
  Pose inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
};

Eigen::Matrix3d skew(const Eigen::Vector3d& v);

/// Rotation vector, of length [0, pi].
Eigen::Vector3d log_rotation(const Eigen::Matrix3d& rotation);
Eigen::Matrix3d exp_rotation(const Eigen::Vector3d& omega);

Vector6d log(const Pose& pose);
Pose exp(const Vector6d& xi);

/// Exp(Adjoint(T) x) = T Exp(x) T^-1.
Matrix6d adjoint(const Pose& pose);

/// d Log(T Exp(x)) / dx at x = 0, where xi = Log(T).
Matrix6d right_jacobian_inverse(const Vector6d& xi);

/// pose Exp(xi), with the rotation made orthonormal again.
Pose retract(const Pose& pose, const Vector6d& xi);

}  // namespace gpureg::pose_graph
