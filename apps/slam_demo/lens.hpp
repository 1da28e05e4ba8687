// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "camera.hpp"

namespace slam_demo {

/// How a colour camera differs from the pinhole that stands for it: what is added to fx fy cx cy
/// (pixels), and k1 k2 of Brown-Conrady's radial distortion.
using Lens = std::array<double, 6>;

/// Where the image has what the pinhole has at a pixel, and the reverse.
Eigen::Vector2d in_image(const Pinhole& camera, const Lens& lens, const Eigen::Vector2d& pixel);
Eigen::Vector2d in_pinhole(const Pinhole& camera, const Lens& lens, const Eigen::Vector2d& pixel);

/// Images as the pinhole would take them; without a difference the images themselves.
class Rectification {
 public:
  Rectification(const Pinhole& camera, const Lens& lens, const cv::Size& size);
  cv::Mat operator()(const cv::Mat& image, int interpolation) const;

 private:
  cv::Mat x_, y_;  // of cv::remap; empty: no difference
};

}  // namespace slam_demo
