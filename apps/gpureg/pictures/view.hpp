// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "gpureg/point_cloud.hpp"

namespace gpureg::cli {

/// Rotation from the frame of the cloud to the axes of the picture; its rows are right, down and
/// forward. A cloud in the frame of a depth camera (z forward, y down, points in front of the
/// origin) is viewed from behind the camera. Any other cloud is taken as z up and viewed obliquely
/// from above.
Eigen::Matrix3d choose_view(const PointCloud& cloud);

}  // namespace gpureg::cli
