// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/plan.hpp"
#include "localization/plan/floor_plan.hpp"

namespace gpureg::localization {

/// A scan with one of its directions upright, relative to its middle.
struct Upright {
  Eigen::Matrix3f turn = Eigen::Matrix3f::Identity();
  std::vector<plan::Wall> walls, coarse_walls;
  struct Point {
    plan::Wall at;       ///< in cells
    int height;          ///< cells
    std::uint32_t flat;  ///< facing::kFloor, facing::kCeiling, or 0: a wall
  };
  std::vector<Point> points;  ///< for the height
  int headings = 0;           ///< steps of a coarse turn
};

/// What a scan shows, relative to its middle.
struct ScanSurface {
  std::vector<Eigen::Vector3f> points, normals;
};

/// Directions of a scan that may be the vertical of the map: its most frequent normals, and what is
/// perpendicular to the first two, for a scan that sees walls alone.
/// @param has_sides false: of the scan or of the map nobody knows which side was seen.
std::vector<Eigen::Vector3f> possible_verticals(const ScanSurface& scan, const FloorPlan& plan,
                                                bool has_sides);

Upright stand(const ScanSurface& scan, const Eigen::Vector3f& up, float cell);

}  // namespace gpureg::localization
