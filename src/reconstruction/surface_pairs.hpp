// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "gpureg/reconstruction.hpp"
#include "pose_graph/se3.hpp"
#include "reconstruction/surface_grid.hpp"

namespace gpureg::reconstruction {

/// Sums over the correspondences of the points of one scan with the surface of another one, for a
/// displacement of the point in the target's frame: target_from_source <- Exp(x)
/// target_from_source, rotation first.
struct SurfaceSums {
  pose_graph::Matrix6d information = pose_graph::Matrix6d::Zero();
  pose_graph::Vector6d gradient = pose_graph::Vector6d::Zero();
  std::size_t count = 0;        ///< correspondences
  double squared_distance = 0;  ///< sum over them, point to plane, metres^2
};

/// How correspondences are found and weighed in one iteration.
struct Association {
  double kernel_width = 0;  ///< metres
  float min_cosine = 0;
  double point_information = 0;  ///< of one point's distance, 1/metres^2
  std::uint32_t max_points = 0;
};

/// Variance of every point relative to one within the range, see RefineOptions::noise_range.
std::vector<float> relative_variances(const Surface& surface, double noise_range);

/// Closest points of every chosen source point; robust point-to-plane sums in a fixed order.
/// @param source_variances, target_variances as relative_variances().
SurfaceSums surface_sums(const Surface& source, const std::vector<float>& source_variances,
                         const SurfaceGrid& grid, const Surface& target,
                         const std::vector<float>& target_variances,
                         const pose_graph::Pose& target_from_source,
                         const Association& association);

}  // namespace gpureg::reconstruction
