// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "gpureg/point_cloud.hpp"
#include "gpureg/result.hpp"
#include "image.hpp"

namespace gpureg::cli {

/// Right half of the picture: a pose with its title, or the title alone.
struct PosedTitle {
  std::optional<Eigen::Isometry3d> target_from_source;
  std::string title;
};

PosedTitle pose_of(const RegistrationResult& result);

/// Two panels side by side: source (yellow) and target (blue) as they came, and after the pose.
Image before_after(const PointCloud& source, const PointCloud& target, const PosedTitle& after,
                   int panel_width = 640, int panel_height = 560);

}  // namespace gpureg::cli
