// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <unordered_set>
#include <vector>

#include "data/sensor/ray_scene.hpp"

/// The true surfaces that a camera has seen, for the evaluation of maps.
namespace gpureg::synthetic {

/// Points on the surfaces of a scene, at most one per cell of 1 cm. Not thread-safe; one object per
/// thread.
class VisibleSurface {
 public:
  /// Adds what a camera sees within the depths (metres, along the optical axis), without noise.
  void look(const RayScene& scene, const Eigen::Isometry3d& world_from_camera, double min_depth,
            double max_depth);

  struct Point {
    std::uint64_t cell;
    Eigen::Vector3f position, normal;  ///< world; the normal faces the camera
  };
  const std::vector<Point>& points() const { return points_; }

 private:
  std::vector<Point> points_;
  std::unordered_set<std::uint64_t> cells_;
};

/// Writes the points of all, the first of each cell, as binary PLY with normals. Throws IoError.
void write_surface(const std::string& path, const std::vector<VisibleSurface>& surfaces);

}  // namespace gpureg::synthetic
