// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "gpureg/evaluation/trajectory.hpp"

/// Distance of a map to the true surface (component `evaluation`). Thread-safe.
namespace gpureg::evaluation {

/// Options of evaluate_surface().
struct SurfaceOptions {
  /// If the true points have normals and the nearest one is at most this far away, metres, >= 0:
  /// the distance is that to its tangent plane, because the surface goes on between the points.
  /// Three times their spacing is a good value. 0: distances to points.
  double plane_reach = 0.03;
  /// Distances beyond count as this one, metres, > 0.
  double max_distance = 0.2;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Distances of the points of a map.
struct SurfaceEvaluation {
  ErrorStatistics distance;  ///< metres
  std::size_t beyond = 0;    ///< points that are farther than max_distance
  std::size_t skipped = 0;   ///< points with a coordinate that is not finite; they do not count
};

/// Distance of every point of a map to the nearest true point or its tangent plane.
/// @param map points in the frame of the truth, metres.
/// @param true_points points of the true surface; those that are not finite do not count.
/// @param true_normals unit normals of the true points, or none.
/// @throws InvalidArgument for options out of range, no finite true point, no finite point of the
///   map, or a number of normals that is neither 0 nor that of the true points.
/// Source: surface statistics of Handa et al. 2014 (ICL-NUIM), to tangent planes.
SurfaceEvaluation evaluate_surface(const std::vector<Eigen::Vector3f>& map,
                                   const std::vector<Eigen::Vector3f>& true_points,
                                   const std::vector<Eigen::Vector3f>& true_normals = {},
                                   const SurfaceOptions& options = {});

}  // namespace gpureg::evaluation
