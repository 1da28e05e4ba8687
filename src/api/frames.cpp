// SPDX-License-Identifier: BSD-3-Clause
#include "api/frames.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gpureg {

/// Moments of the local, scaled points to moments of the points in the cloud's frame.
CorrespondenceMoments to_frame(const Moments& m, const PreparedState& cloud) {
  const double unit = 1.0 / 1099511627776.0, r = cloud.radius;
  CorrespondenceMoments out;
  out.count = m.count;
  const double n = static_cast<double>(m.count);
  const Eigen::Vector3d o = origin_of(cloud);
  const Eigen::Vector3d s =
      Eigen::Vector3d(static_cast<double>(m.sum[0]), static_cast<double>(m.sum[1]),
                      static_cast<double>(m.sum[2])) *
      (unit * r);
  Eigen::Matrix3d q;
  const double f = unit * r * r;
  const auto e = [&](int k) { return static_cast<double>(m.outer[k]) * f; };
  q << e(0), e(1), e(2), e(1), e(3), e(4), e(2), e(4), e(5);
  out.sum = s + n * o;
  out.outer = q + s * o.transpose() + o * s.transpose() + n * o * o.transpose();
  return out;
}

Eigen::Isometry3d rows_from_local(const Pose<double>& pose, const PreparedState& moved,
                                  const PreparedState& fixed) {
  const Eigen::Quaterniond q(pose.w, pose.x, pose.y, pose.z);
  Eigen::Isometry3d fixed_from_moved = Eigen::Isometry3d::Identity();
  fixed_from_moved.linear() = q.normalized().toRotationMatrix();
  fixed_from_moved.translation() = Eigen::Vector3d(pose.tx, pose.ty, pose.tz) + origin_of(fixed) -
                                   fixed_from_moved.linear() * origin_of(moved);
  return fixed_from_moved;
}

Pose<double> local_from_rows(const Eigen::Isometry3d& fixed_from_moved, const PreparedState& moved,
                             const PreparedState& fixed) {
  const Eigen::Vector3d shift = fixed_from_moved.translation() +
                                fixed_from_moved.linear() * origin_of(moved) - origin_of(fixed);
  const Eigen::Quaterniond q = Eigen::Quaterniond(fixed_from_moved.linear()).normalized();
  return {q.w(), q.x(), q.y(), q.z(), shift.x(), shift.y(), shift.z()};
}

Eigen::Isometry3d rows_from_frames(const UnalignedIsometry3d& target_from_source,
                                   const PreparedState& source, const PreparedState& target) {
  Eigen::Isometry3d out = target_from_source;
  out.translation() = target_from_source * offset_of(source) - offset_of(target);
  return out;
}

void move_to_frame(UnalignedIsometry3d& target_from_source, const PreparedState& source,
                   const PreparedState& target) {
  const Eigen::Vector3d s = offset_of(source), t = offset_of(target);
  if (s.isZero(0) && t.isZero(0)) return;
  target_from_source.translation() += t - target_from_source.linear() * s;
}

void move_to_frame(CorrespondenceMoments& moments, const PreparedState& cloud) {
  const Eigen::Vector3d offset = offset_of(cloud);
  if (offset.isZero(0)) return;
  const double n = static_cast<double>(moments.count);
  moments.outer += offset * moments.sum.transpose() + moments.sum * offset.transpose() +
                   n * offset * offset.transpose();
  moments.sum += n * offset;
}

void move_to_frames(RegistrationResult& result, const PreparedState& source,
                    const PreparedState& target) {
  move_to_frame(result.target_from_source, source, target);
  for (RegistrationMode& mode : result.modes)
    move_to_frame(mode.target_from_source, source, target);
  move_to_frame(result.source_moments, source);
  move_to_frame(result.target_moments, target);
}

/// RMS distance between the positions that two poses give the source points in correspondences.
double distance_between(const UnalignedIsometry3d& a, const UnalignedIsometry3d& b,
                        const CorrespondenceMoments& points) {
  if (points.count == 0) return std::numeric_limits<double>::infinity();
  const double n = static_cast<double>(points.count);
  const Eigen::Matrix3d m = a.linear() - b.linear();
  const Eigen::Vector3d t = a.translation() - b.translation();
  return std::sqrt(
      std::max(0.0, ((m * points.outer * m.transpose()).trace() + 2 * t.dot(m * points.sum)) / n +
                        t.squaredNorm()));
}

}  // namespace gpureg
