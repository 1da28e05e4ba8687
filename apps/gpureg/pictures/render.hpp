// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "gpureg/point_cloud.hpp"
#include "pictures/image.hpp"

namespace gpureg::cli {

/// A cloud with its pose and its color.
struct Layer {
  const PointCloud* cloud = nullptr;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  Color color;
};

/// Perspective rendering of points as discs with a depth buffer and screen-space ambient occlusion.
/// The camera is fitted to the layers. view: see choose_view.
Image render(const std::vector<Layer>& layers, const Eigen::Matrix3d& view, int width, int height);

}  // namespace gpureg::cli
