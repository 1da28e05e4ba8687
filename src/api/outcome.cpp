// SPDX-License-Identifier: BSD-3-Clause
#include "api/outcome.hpp"

#include <cmath>

#include "pipeline/conclude.hpp"

namespace gpureg {
namespace {

Eigen::Vector3d origin_of(const PreparedState& cloud) { return Eigen::Vector3f(cloud.origin[0], cloud.origin[1], cloud.origin[2]).cast<double>(); }

/// Moments of the local, scaled points to moments of the points in the cloud's frame.
CorrespondenceMoments to_frame(const Moments& m, const PreparedState& cloud) {
  const double unit = 1.0 / 1099511627776.0, r = cloud.radius;
  CorrespondenceMoments out;
  out.count = m.count;
  const double n = static_cast<double>(m.count);
  const Eigen::Vector3d o = origin_of(cloud);
  const Eigen::Vector3d s = Eigen::Vector3d(static_cast<double>(m.sum[0]), static_cast<double>(m.sum[1]), static_cast<double>(m.sum[2])) * (unit * r);
  Eigen::Matrix3d q;
  const double f = unit * r * r;
  const auto e = [&](int k) { return static_cast<double>(m.outer[k]) * f; };
  q << e(0), e(1), e(2), e(1), e(3), e(4), e(2), e(4), e(5);
  out.sum = s + n * o;
  out.outer = q + s * o.transpose() + o * s.transpose() + n * o * o.transpose();
  return out;
}

}  // namespace

RegistrationResult to_result(const PairOutcome& outcome, const PreparedState& source, const PreparedState& target, bool swapped,
                             const ScoreOptions& options) {
  RegistrationResult result;
  result.reason = outcome.reason;
  result.status = outcome.reason == RegistrationReason::none ? RegistrationStatus::aligned : RegistrationStatus::not_aligned;
  result.has_candidate = outcome.has_pose;
  result.statistics = outcome.statistics;
  result.timings = outcome.timings;
  result.statistics.swapped = swapped;
  if (swapped) {
    std::swap(result.statistics.source_points, result.statistics.target_points);
    if (result.reason == RegistrationReason::too_few_source_points)
      result.reason = RegistrationReason::too_few_target_points;
    else if (result.reason == RegistrationReason::too_few_target_points)
      result.reason = RegistrationReason::too_few_source_points;
  }
  if (!outcome.has_pose) return result;

  const PreparedState& moved = swapped ? target : source;
  const PreparedState& fixed = swapped ? source : target;
  const Eigen::Quaterniond q(outcome.pose.w, outcome.pose.x, outcome.pose.y, outcome.pose.z);
  Eigen::Isometry3d fixed_from_moved = Eigen::Isometry3d::Identity();
  fixed_from_moved.linear() = q.normalized().toRotationMatrix();
  fixed_from_moved.translation() = Eigen::Vector3d(outcome.pose.tx, outcome.pose.ty, outcome.pose.tz) + origin_of(fixed) -
                                   fixed_from_moved.linear() * origin_of(moved);
  result.target_from_source = swapped ? fixed_from_moved.inverse() : fixed_from_moved;

  result.inlier_ratio = pipeline::inlier_ratio(outcome.statistics);
  result.score = result.inlier_ratio;
  if (outcome.support.inliers > 0)
    result.inlier_rmse = static_cast<double>(options.max_correspondence_distance) *
                         std::sqrt(static_cast<double>(outcome.support.residual) / static_cast<double>(kResidualScale) / outcome.support.inliers);
  result.source_moments = to_frame(swapped ? outcome.target_moments : outcome.source_moments, source);
  result.target_moments = to_frame(swapped ? outcome.source_moments : outcome.target_moments, target);
  return result;
}

}  // namespace gpureg
