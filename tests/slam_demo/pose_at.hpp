// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

namespace slam_demo {

/// turn: about y, radians.
inline Eigen::Isometry3d at(double x, double y, double z, double turn = 0) {
  Eigen::Isometry3d pose(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY()));
  pose.translation() = Eigen::Vector3d(x, y, z);
  return pose;
}

}  // namespace slam_demo
