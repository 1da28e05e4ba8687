// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "gpureg/point_cloud.hpp"

namespace gpureg::cli {

/// Rows are the picture's right, down and forward, in the frame of the cloud. A cloud that a sensor
/// at its origin saw ahead of itself (z forward, y down, as depth cameras have it) is looked at
/// over the sensor's shoulder; any other one, as from a turning scanner (z up), from above and
/// aside.
Eigen::Matrix3d choose_view(const PointCloud& cloud);

}  // namespace gpureg::cli
