// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "gpureg/point_cloud.hpp"
#include "image.hpp"

namespace gpureg::cli {

/// A cloud, where it stands and how it is painted.
struct Layer {
  const PointCloud* cloud = nullptr;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  Color color;
};

/// Draws points as discs into a depth buffer, in perspective, and shades what stands before other
/// things; the picture is fitted around the layers. view: rows right, down, forward (see
/// choose_view).
Image render(const std::vector<Layer>& layers, const Eigen::Matrix3d& view, int width, int height);

}  // namespace gpureg::cli
