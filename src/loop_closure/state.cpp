// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/state.hpp"

#include <algorithm>
#include <cmath>

#include "math/trigonometry.hpp"
#include "pose_graph/validate.hpp"

namespace gpureg::loop_closure {
namespace {

/// Rotations further from orthonormal are made so again.
constexpr double kSavedOrthonormal = 1e-5;

}  // namespace

const Coarse& Node::coarse() const {
  static const Coarse nothing;
  return observed ? *observed : nothing;
}

UnalignedIsometry3d rigid(UnalignedIsometry3d pose) {
  const Eigen::Matrix3d r = pose.linear();
  if ((r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kSavedOrthonormal)
    pose.linear() = Eigen::Quaterniond(r).normalized().toRotationMatrix();
  pose.translation() =
      pose.translation().cwiseMax(-pose_graph::kFarthest).cwiseMin(pose_graph::kFarthest).eval();
  return pose;
}

UnalignedIsometry3d to_isometry(const pose_graph::Pose& pose) {
  UnalignedIsometry3d out;
  out.setIdentity();
  out.linear() = pose.rotation;
  out.translation() = pose.translation;
  return out;
}

double sigma_at(const Matrix6d& covariance, const Eigen::Vector3d& point) {
  Eigen::Matrix<double, 3, 6> moved;
  moved << -pose_graph::skew(point), Eigen::Matrix3d::Identity();
  return std::sqrt(std::max(0.0, (moved * covariance * moved.transpose()).trace() / 3));
}

Odometry modelled_odometry(FragmentId source, FragmentId target,
                           const UnalignedIsometry3d& target_from_source, const Options& options) {
  const pose_graph::DriftOptions& drift = options.graph.drift;
  Odometry edge;
  edge.source = source;
  edge.target = target;
  edge.target_from_source = target_from_source;
  edge.modelled = true;
  edge.length = target_from_source.translation().norm();
  const double degrees =
      pose_graph::log_rotation(Eigen::Matrix3d(target_from_source.linear())).norm() /
      portable::kRadiansPerDegree;
  const double translation =
      std::max(drift.min_translation, drift.translation_per_metre * edge.length);
  const double rotation = std::max(drift.min_rotation, drift.rotation_per_metre * edge.length +
                                                           drift.rotation_per_degree * degrees);
  Vector6d information;
  information.head<3>().setConstant(1 / portable::square(rotation * portable::kRadiansPerDegree));
  information.tail<3>().setConstant(1 / portable::square(translation));
  edge.information = UnalignedMatrix6d(information.asDiagonal());
  return edge;
}

// Independent errors of n edges of length l have the variance n e^2; errors of one sign n^2 e^2
// while n l is within the correlation length c, and n e^2 c / l beyond.
double correlation_factor(double length, double steps, double correlation) {
  if (!(length > 0)) return 1;
  return std::max(1.0, std::min(length, correlation) * steps / length);
}

void choose_mode(LoopRecord& record, std::size_t mode) {
  record.mode = static_cast<std::uint32_t>(mode);
  const Mode& chosen = record.modes[mode];
  Loop& loop = record.loop;
  loop.confidence = chosen.confidence;
  loop.drift_ratio = chosen.drift_ratio;
  // Once a fragment of the pair is gone the edge runs between others, and the reported pose stays.
  if (record.source != loop.source || record.target != loop.target) return;
  loop.target_from_source = chosen.target_from_source;
  loop.information = chosen.information;
}

}  // namespace gpureg::loop_closure
