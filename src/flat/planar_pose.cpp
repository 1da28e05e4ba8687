// SPDX-License-Identifier: BSD-3-Clause
#include "flat/planar_pose.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace gpureg {
namespace {

/// Axes in the plane and its normal as columns: the smallest rotation of z to the normal, which is
/// not below the xy plane.
Eigen::Matrix3d axes_of(const ScanPlane& plane) {
  const Eigen::Vector3d n = normal_of(plane);
  const double f = 1.0 / (1.0 + n.z()), mixed = -n.x() * n.y() * f;
  Eigen::Matrix3d axes;
  axes << 1.0 - n.x() * n.x() * f, mixed, n.x(),  //
      mixed, 1.0 - n.y() * n.y() * f, n.y(),      //
      -n.x(), -n.y(), n.z();
  return axes;
}

}  // namespace

UnalignedIsometry3d planar(const UnalignedIsometry3d& target_from_source, const ScanPlane& source,
                           const ScanPlane& target, const Eigen::Vector3d& source_point) {
  const Eigen::Matrix3d from = axes_of(source), to = axes_of(target);
  const Eigen::Matrix3d between = to.transpose() * target_from_source.linear() * from;
  // A scanner that hangs upside down turns its plane over.
  const double side = between(2, 2) < 0 ? -1.0 : 1.0;
  double c = between(0, 0) + side * between(1, 1), s = between(1, 0) - side * between(0, 1);
  const double norm = std::sqrt(c * c + s * s);
  c = norm > 0 ? c / norm : 1.0;
  s = norm > 0 ? s / norm : 0.0;
  Eigen::Matrix3d turn;
  turn << c, -side * s, 0, s, side * c, 0, 0, 0, side;
  const Eigen::Vector3d moved = target_from_source * source_point, normal = normal_of(target);
  UnalignedIsometry3d out;
  out.linear() = to * turn * from.transpose();
  const Eigen::Vector3d shift = moved - out.linear() * source_point;
  out.translation() =
      shift - normal * normal.dot(shift) + normal * (target.offset - side * source.offset);
  return out;
}

CorrespondenceMoments planar(const CorrespondenceMoments& moments, const ScanPlane& plane) {
  CorrespondenceMoments out;
  if (moments.count == 0) return out;
  const Eigen::Vector3d n = normal_of(plane);
  const Eigen::Matrix3d flat = Eigen::Matrix3d::Identity() - n * n.transpose();
  const Eigen::Vector3d sum = flat * moments.sum, lift = plane.offset * n;
  const double count = static_cast<double>(moments.count);
  out.count = std::max<std::uint64_t>(1, moments.count / plane.layers);
  const double scale = static_cast<double>(out.count) / count;
  out.sum = scale * (sum + count * lift);
  out.outer = scale * (flat * moments.outer * flat.transpose() + sum * lift.transpose() +
                       lift * sum.transpose() + count * lift * lift.transpose());
  return out;
}

}  // namespace gpureg
