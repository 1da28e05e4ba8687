// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace slam_demo {

struct StampedPose {
  double time = 0;  ///< seconds
  Eigen::Isometry3d world_from_camera = Eigen::Isometry3d::Identity();
};
using Trajectory = std::vector<StampedPose>;  ///< ascending times

/// Reads lines `time tx ty tz qx qy qz qw`; '#' starts a comment. Throws gpureg::IoError naming
/// file and line: unreadable, not eight numbers, a quaternion of length 0.
Trajectory read_tum(const std::string& path);

/// The same lines, nine digits behind the point, all or nothing. Throws gpureg::IoError.
void write_tum(const std::string& path, const Trajectory& trajectory);

/// Absolute trajectory error after the best rigid alignment (Horn 1987, Umeyama 1991).
struct AteResult {
  std::size_t poses = 0;                           ///< with a true pose within max_difference
  double rmse = 0, mean = 0, median = 0, max = 0;  ///< metres
  Eigen::Isometry3d truth_from_estimate = Eigen::Isometry3d::Identity();
  std::vector<double> times, errors;  ///< seconds and metres of each pose
};

/// Compares every estimated pose with the true one nearest in time. Fewer than three poses give no
/// errors. max_difference: seconds.
AteResult absolute_error(const Trajectory& truth, const Trajectory& estimate,
                         double max_difference = 0.01);

}  // namespace slam_demo
