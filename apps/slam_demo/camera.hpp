// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

namespace slam_demo {

/// A camera without distortion. Lengths in pixels.
struct Pinhole {
  double fx = 525, fy = 525, cx = 319.5, cy = 239.5;

  Eigen::Vector2d project(const Eigen::Vector3d& p) const {
    return {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy};
  }
  /// The point at depth z (metres along the optical axis) behind a pixel.
  Eigen::Vector3d unproject(double u, double v, double z) const {
    return {(u - cx) / fx * z, (v - cy) / fy * z, z};
  }
};

/// Colour and depth camera of one device. The colour camera is tracked.
struct Rig {
  Pinhole colour, depth;
  Eigen::Isometry3d colour_from_depth = Eigen::Isometry3d::Identity();
  bool registered = true;            ///< depth images are already in the colour camera
  double depth_units = 5000;         ///< values of a depth image per metre
  double min_depth = 0.3;            ///< metres; smaller depths are dropped
  double max_depth = 4.0;            ///< metres; greater depths are dropped
  bool truth_of_depth = false;       ///< the truth has the poses of the depth camera
  bool known = false;                ///< the cameras are given, not only a guess
  bool flipped = false;              ///< images are turned upside down: y points up
  cv::Mat undistort_x, undistort_y;  ///< of cv::remap, for the colour camera; empty: no distortion
};

/// The colour camera of images of a size, without distortion or with OpenCV's coefficients. fy < 0,
/// y points up: the images are turned upside down, and fy is positive then.
/// @throws gpureg::InvalidArgument for distortion together with fy < 0.
void set_camera(const Pinhole& camera, const cv::Mat1d& distortion, const cv::Size& size, Rig& rig);

/// Depth in metres (0: none) from the values of a file, in the pixels of the colour camera. A depth
/// image that is not registered is projected into the colour camera; of several surfaces behind a
/// pixel the nearest stays.
cv::Mat1f depth_in_colour(const cv::Mat& raw, const Rig& rig);

/// Depth in metres (0: none) as another camera, or the same one elsewhere, would see it.
cv::Mat1f seen_from(const Pinhole& to, const Eigen::Isometry3d& to_from_from, const Pinhole& from,
                    const cv::Mat1f& depth);

}  // namespace slam_demo
