// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/rgbd/depth.hpp>
#include <optional>

#include "camera.hpp"

namespace slam_demo {

/// Motion between two frames from all pixels and depths (OpenCV's RGB-D ICP odometry), for frames
/// with too few features. It drifts more than features do. Not thread-safe.
class DenseOdometry {
 public:
  explicit DenseOdometry(const Pinhole& camera);

  /// before_from_now, from a guess of it; none where the images do not determine it, and for a
  /// motion that no hand makes between two frames.
  std::optional<Eigen::Isometry3d> motion(const cv::Mat1b& grey_before, const cv::Mat1f& before,
                                          const cv::Mat1b& grey_now, const cv::Mat1f& now,
                                          const Eigen::Isometry3d& guess) const;

 private:
  cv::Ptr<cv::rgbd::Odometry> odometry_;
};

}  // namespace slam_demo
