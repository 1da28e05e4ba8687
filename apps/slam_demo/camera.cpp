// SPDX-License-Identifier: BSD-3-Clause
#include "camera.hpp"

#include <cmath>
#include <gpureg/error.hpp>
#include <opencv2/calib3d.hpp>

namespace slam_demo {

void set_camera(const Pinhole& camera, const cv::Mat1d& distortion, const cv::Size& size,
                Rig& rig) {
  rig.colour = camera;
  rig.known = true;
  rig.flipped = camera.fy < 0;
  rig.undistort_x = rig.undistort_y = cv::Mat();
  const bool distorted = !distortion.empty() && cv::countNonZero(distortion) > 0;
  if (rig.flipped) {
    if (distorted)
      throw gpureg::InvalidArgument("a camera with distortion needs focal lengths > 0");
    rig.colour.fy = -camera.fy;
    rig.colour.cy = size.height - 1 - camera.cy;
  }
  if (!distorted) return;
  const cv::Matx33d k(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  cv::initUndistortRectifyMap(k, distortion, cv::noArray(), k, size, CV_32FC1, rig.undistort_x,
                              rig.undistort_y);
}

cv::Mat1f depth_in_colour(const cv::Mat& raw, const Rig& rig) {
  cv::Mat1f metres(raw.size(), 0.0f);
  for (int y = 0; y < raw.rows; ++y) {
    for (int x = 0; x < raw.cols; ++x) {
      const std::uint16_t value = raw.at<std::uint16_t>(y, x);
      const double z = value / rig.depth_units;
      if (value == 0 || value == 65535 || z < rig.min_depth || z > rig.max_depth) continue;
      metres(y, x) = static_cast<float>(z);
    }
  }
  if (rig.registered) return metres;
  return seen_from(rig.colour, rig.colour_from_depth, rig.depth, metres);
}

cv::Mat1f seen_from(const Pinhole& to, const Eigen::Isometry3d& to_from_from, const Pinhole& from,
                    const cv::Mat1f& depth) {
  cv::Mat1f result(depth.size(), 0.0f);
  // A depth pixel covers about one pixel of the other camera, a little less where the focal lengths
  // differ: two pixels are written, so that no holes stay.
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      if (depth(y, x) == 0) continue;
      const Eigen::Vector3d p = to_from_from * from.unproject(x, y, depth(y, x));
      if (p.z() <= 0) continue;
      const Eigen::Vector2d at = to.project(p);
      for (const int dx : {0, 1}) {
        for (const int dy : {0, 1}) {
          const int u = static_cast<int>(std::floor(at.x())) + dx,
                    v = static_cast<int>(std::floor(at.y())) + dy;
          if (u < 0 || v < 0 || u >= depth.cols || v >= depth.rows) continue;
          float& z = result(v, u);
          if (z == 0 || p.z() < z) z = static_cast<float>(p.z());
        }
      }
    }
  }
  return result;
}

}  // namespace slam_demo
