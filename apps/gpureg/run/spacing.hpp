// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "gpureg/point_cloud.hpp"

namespace gpureg::cli {

/// The points with finite coordinates.
std::vector<Eigen::Vector3f> finite_points(const std::vector<Eigen::Vector3f>& points);

/// Median distance from a sample of the points to their nearest (or rank-th nearest) neighbour that
/// is not at the same place; 0 where there is none. The points must be finite.
double median_spacing(const std::vector<Eigen::Vector3f>& points, int rank = 1);

std::vector<PointCloudView> views_of(const std::vector<PointCloud>& clouds);

/// Longest side of the box around the finite points; 0 where there are fewer than two.
double extent_of(const std::vector<Eigen::Vector3f>& points);

/// A voxel larger than the whole cloud leaves next to nothing, and any pose fits that. Throws
/// InvalidArgument naming the size and what is smaller; an extent of 0 passes, as alignment itself
/// says why such a cloud is of no use.
void check_voxel_size(float voxel_size, double extent, const std::string& what);

/// Says on stderr which clouds an automatic voxel size leaves too few points: below 1,000, features
/// describe hardly anything.
/// @param prepared file and number of prepared points of each cloud.
void note_few_points(const std::vector<std::pair<std::string, std::size_t>>& prepared);

}  // namespace gpureg::cli
