// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "gpureg/point_cloud.hpp"
#include "gpureg/result.hpp"
#include "pictures/image.hpp"

namespace gpureg::cli {

/// Pose and title of the right panel. Without a pose the panel is empty.
struct PosedTitle {
  std::optional<Eigen::Isometry3d> target_from_source;
  std::string title;
  const PointCloud* unscaled = nullptr;  ///< the source as it was given, where it was scaled
};

PosedTitle pose_of(const RegistrationResult& result);

/// Two panels side by side with source (yellow) and target (blue): in their input frames, and with
/// the source transformed by the pose.
Image before_after(const PointCloud& source, const PointCloud& target, const PosedTitle& after,
                   int panel_width = 640, int panel_height = 560);

}  // namespace gpureg::cli
