// SPDX-License-Identifier: BSD-3-Clause
#include "lens.hpp"

#include <opencv2/imgproc.hpp>

namespace slam_demo {

Eigen::Vector2d in_image(const Pinhole& c, const Lens& lens, const Eigen::Vector2d& pixel) {
  if (lens == Lens{}) return pixel;
  const double x = (pixel.x() - c.cx) / c.fx, y = (pixel.y() - c.cy) / c.fy, r = x * x + y * y;
  const double scale = 1 + r * (lens[4] + r * lens[5]);
  return {(c.fx + lens[0]) * x * scale + c.cx + lens[2],
          (c.fy + lens[1]) * y * scale + c.cy + lens[3]};
}

Eigen::Vector2d in_pinhole(const Pinhole& camera, const Lens& lens, const Eigen::Vector2d& pixel) {
  constexpr int kRounds = 20;  // each leaves a third of the error, at most
  if (lens == Lens{}) return pixel;
  Eigen::Vector2d result = pixel;
  for (int k = 0; k < kRounds; ++k) result += pixel - in_image(camera, lens, result);
  return result;
}

Rectification::Rectification(const Pinhole& camera, const Lens& lens, const cv::Size& size) {
  if (lens == Lens{} || size.empty()) return;
  x_.create(size, CV_32FC1);
  y_.create(size, CV_32FC1);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const Eigen::Vector2d from = in_image(camera, lens, Eigen::Vector2d(u, v));
      x_.at<float>(v, u) = static_cast<float>(from.x());
      y_.at<float>(v, u) = static_cast<float>(from.y());
    }
  }
}

cv::Mat Rectification::operator()(const cv::Mat& image, int interpolation) const {
  if (x_.empty() || image.empty()) return image;
  cv::Mat result;
  cv::remap(image, result, x_, y_, interpolation);
  return result;
}

}  // namespace slam_demo
