// SPDX-License-Identifier: BSD-3-Clause
#include "loop_closure/state.hpp"
#include "math/exponential.hpp"

#include <algorithm>
#include <cmath>

namespace gpureg::loop_closure {
namespace {

constexpr double kRadians = 3.14159265358979323846 / 180;

}  // namespace

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

UnalignedMatrix6d drift_information(const UnalignedIsometry3d& motion, const Options& options) {
  const pose_graph::DriftOptions& drift = options.graph.drift;
  const double metres = motion.translation().norm();
  const double degrees =
      pose_graph::log_rotation(Eigen::Matrix3d(motion.linear())).norm() / kRadians;
  // Errors of one sign over a length c make the variance of n edges of length l grow as (n l) c
  // rather than as n l^2: each edge carries the part l c of it.
  const double share =
      metres > 0 ? std::sqrt(std::max(1.0, options.drift_correlation / metres)) : 1;
  const double translation =
      std::max(drift.min_translation, share * drift.translation_per_metre * metres);
  const double rotation = std::max(drift.min_rotation, share * drift.rotation_per_metre * metres +
                                                           drift.rotation_per_degree * degrees);
  Vector6d information;
  information.head<3>().setConstant(1 / portable::square(rotation * kRadians));
  information.tail<3>().setConstant(1 / portable::square(translation));
  return UnalignedMatrix6d(information.asDiagonal());
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
