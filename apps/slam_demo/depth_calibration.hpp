// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <opencv2/core.hpp>
#include <string>

#include "lens.hpp"

namespace slam_demo {

/// What a depth camera adds to each inverse depth: measured 1/z = true 1/z + offset(pixel). A fixed
/// image for one camera, smooth, so a grid over the image holds it; bilinear between the nodes.
/// Pixels are those of the colour camera's pinhole; lens: how its images differ from that.
struct DepthCalibration {
  static constexpr int kColumns = 9, kRows = 7;
  static constexpr std::size_t kNodes = std::size_t{kColumns} * kRows;
  int width = 640, height = 480;         ///< of the image, pixels; the outer nodes are on its edge
  std::array<double, kNodes> offsets{};  ///< 1/metres, row by row
  Lens lens{};                           ///< in pixels of the images as they are loaded

  struct Weight {
    std::size_t node;
    double share;
  };
  /// The four different nodes around a pixel; outside the image those of its edge.
  std::array<Weight, 4> around(double u, double v) const;

  double offset(double u, double v) const;
  /// True depth of a measured one, metres; 0 (none) stays 0.
  double corrected(double u, double v, double depth) const;
  cv::Mat1f corrected(const cv::Mat1f& depth) const;

  /// Where a point in the camera goes, metres, that another calibration put there.
  Eigen::Vector3d moved(const Pinhole& camera, const DepthCalibration& before,
                        const Eigen::Vector3d& point) const;

  /// Largest difference of two nodes, 1/metres.
  double difference(const DepthCalibration& other) const;
};

/// JSON, as the output has it. Both throw gpureg::IoError naming the file.
void write_depth_calibration(const std::string& path, const DepthCalibration& calibration);
DepthCalibration read_depth_calibration(const std::string& path);

}  // namespace slam_demo
