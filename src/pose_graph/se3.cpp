// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/se3.hpp"
#include "math/trigonometry.hpp"

#include <cmath>

namespace gpureg::pose_graph {
namespace {

/// Below this squared angle the closed forms lose digits to cancellation; the series, cut after
/// their second term, are then exact to 1e-10 or better.
constexpr double kSmallSquaredAngle = 1e-3;

/// Left Jacobian of SO(3): I + a [w] + b [w]^2.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& w) {
  const double t2 = w.squaredNorm();
  double a, b;
  if (t2 < kSmallSquaredAngle) {
    a = 0.5 - t2 / 24;
    b = 1.0 / 6 - t2 / 120;
  } else {
    const double t = std::sqrt(t2);
    a = (1 - portable::cos(t)) / t2;
    b = (t - portable::sin(t)) / (t2 * t);
  }
  const Eigen::Matrix3d s = skew(w);
  return Eigen::Matrix3d::Identity() + a * s + b * s * s;
}

Eigen::Matrix3d left_jacobian_inverse(const Eigen::Vector3d& w) {
  const double t2 = w.squaredNorm();
  double c;
  if (t2 < kSmallSquaredAngle) {
    c = 1.0 / 12 + t2 / 720;
  } else {
    const double t = std::sqrt(t2);
    // (t / 2) cot(t / 2) by the half angle, which is finite at pi.
    c = (1 - 0.5 * t * portable::cos(0.5 * t) / portable::sin(0.5 * t)) / t2;
  }
  const Eigen::Matrix3d s = skew(w);
  return Eigen::Matrix3d::Identity() - 0.5 * s + c * s * s;
}

/// The lower left block of the left Jacobian of SE(3), rotation first (Barfoot, equation 7.86b).
Eigen::Matrix3d left_jacobian_coupling(const Eigen::Vector3d& w, const Eigen::Vector3d& v) {
  const double t2 = w.squaredNorm();
  double b, c, d;
  if (t2 < kSmallSquaredAngle) {
    b = 1.0 / 6 - t2 / 120;
    c = 1.0 / 24 - t2 / 720;
    d = 1.0 / 120 - t2 / 2520;
  } else {
    const double t = std::sqrt(t2), sine = portable::sin(t), cosine = portable::cos(t);
    b = (t - sine) / (t2 * t);
    c = (0.5 * t2 + cosine - 1) / (t2 * t2);
    d = 0.5 * (c + 3 * (t - sine - t2 * t / 6) / (t2 * t2 * t));
  }
  const Eigen::Matrix3d p = skew(w), r = skew(v);
  const Eigen::Matrix3d pr = p * r, rp = r * p, prp = pr * p;
  return 0.5 * r + b * (pr + rp + prp) + c * (p * pr + rp * p - 3 * prp) + d * (prp * p + p * prp);
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d s;
  s << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return s;
}

Eigen::Vector3d log_rotation(const Eigen::Matrix3d& rotation) {
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  // atan2 keeps all digits near 0 and near pi, where acos of the trace keeps half of them.
  const double scale = sine < 1e-12 ? 2.0 : 2.0 * portable::atan2(sine, q.w()) / sine;
  return scale * q.vec();
}

Eigen::Matrix3d exp_rotation(const Eigen::Vector3d& omega) {
  const double angle = omega.norm(), half = 0.5 * angle;
  const double scale = angle < 1e-12 ? 0.5 : portable::sin(half) / angle;
  Eigen::Quaterniond q;
  q.w() = portable::cos(half);
  q.vec() = scale * omega;
  return q.normalized().toRotationMatrix();
}

Vector6d log(const Pose& pose) {
  Vector6d xi;
  const Eigen::Vector3d w = log_rotation(pose.rotation);
  xi.head<3>() = w;
  xi.tail<3>() = left_jacobian_inverse(w) * pose.translation;
  return xi;
}

Pose exp(const Vector6d& xi) {
  const Eigen::Vector3d w = xi.head<3>();
  return {exp_rotation(w), left_jacobian(w) * xi.tail<3>()};
}

Matrix6d adjoint(const Pose& pose) {
  Matrix6d a;
  a.topLeftCorner<3, 3>() = pose.rotation;
  a.topRightCorner<3, 3>().setZero();
  a.bottomLeftCorner<3, 3>() = skew(pose.translation) * pose.rotation;
  a.bottomRightCorner<3, 3>() = pose.rotation;
  return a;
}

Matrix6d right_jacobian_inverse(const Vector6d& xi) {
  // The right Jacobian is the left one of -xi.
  const Eigen::Vector3d w = -xi.head<3>(), v = -xi.tail<3>();
  const Eigen::Matrix3d inverse = left_jacobian_inverse(w);
  Matrix6d j;
  j.topLeftCorner<3, 3>() = inverse;
  j.topRightCorner<3, 3>().setZero();
  j.bottomLeftCorner<3, 3>() = -inverse * left_jacobian_coupling(w, v) * inverse;
  j.bottomRightCorner<3, 3>() = inverse;
  return j;
}

Pose retract(const Pose& pose, const Vector6d& xi) {
  Pose out = pose * exp(xi);
  out.rotation = Eigen::Quaterniond(out.rotation).normalized().toRotationMatrix();
  return out;
}

}  // namespace gpureg::pose_graph
