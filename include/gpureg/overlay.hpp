// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <string>

#include "gpureg/point_cloud.hpp"

namespace gpureg::io {

/// Writes one coloured binary PLY: the source moved by target_from_source (yellow) and the target
/// (blue), in the target's frame and without non-finite points. Coordinates are float32, or double
/// if the target has an origin.
/// @throws IoError if writing fails.
void write_overlay(const std::string& path, const PointCloud& source, const PointCloud& target,
                   const Eigen::Isometry3d& target_from_source);

}  // namespace gpureg::io
