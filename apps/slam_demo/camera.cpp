// SPDX-License-Identifier: BSD-3-Clause
#include "camera.hpp"

#include <cmath>

namespace slam_demo {

cv::Mat1f depth_in_colour(const cv::Mat& raw, const Rig& rig) {
  cv::Mat1f metres(raw.size(), 0.0f), result(raw.size(), 0.0f);
  for (int y = 0; y < raw.rows; ++y) {
    for (int x = 0; x < raw.cols; ++x) {
      const std::uint16_t value = raw.at<std::uint16_t>(y, x);
      const double z = value / rig.depth_units;
      if (value == 0 || value == 65535 || z < rig.min_depth || z > rig.max_depth) continue;
      metres(y, x) = static_cast<float>(z);
    }
  }
  if (rig.registered) return metres;
  // A depth pixel covers about one colour pixel, a little less where the focal lengths differ: two
  // pixels are written, so that no holes stay.
  for (int y = 0; y < raw.rows; ++y) {
    for (int x = 0; x < raw.cols; ++x) {
      if (metres(y, x) == 0) continue;
      const Eigen::Vector3d p = rig.colour_from_depth * rig.depth.unproject(x, y, metres(y, x));
      if (p.z() <= 0) continue;
      const Eigen::Vector2d at = rig.colour.project(p);
      for (const int dx : {0, 1}) {
        for (const int dy : {0, 1}) {
          const int u = static_cast<int>(std::floor(at.x())) + dx,
                    v = static_cast<int>(std::floor(at.y())) + dy;
          if (u < 0 || v < 0 || u >= raw.cols || v >= raw.rows) continue;
          float& z = result(v, u);
          if (z == 0 || p.z() < z) z = static_cast<float>(p.z());
        }
      }
    }
  }
  return result;
}

}  // namespace slam_demo
