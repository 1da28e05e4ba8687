// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "gpureg/prepared_cloud.hpp"
#include "pose_graph/se3.hpp"

namespace gpureg::loop_closure {

/// What a fragment observed, in a few hundred coarse voxels.
struct Coarse {
  std::vector<Eigen::Vector3f> points;  ///< centroids of the occupied voxels, fragment's frame
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the points
  double radius = 0;                                 ///< of the ball about it that has them all
  double voxel = 0;                                  ///< edge of the voxels, metres
};

/// @param voxel edge, metres; doubled until the voxels are few enough to compare all of them.
Coarse coarse_of(const PreparedCloud& cloud, double voxel);

/// Number that two different clouds hardly ever share: of points, normals, origin, options.
std::uint64_t fingerprint_of(const PreparedCloud& cloud);

/// Expected overlap of two fragments, [0, 1]: the share of the coarse voxels of one that the other
/// observed, the larger of both. A voxel farther away counts by the probability density of the
/// relative pose there.
/// @param sigma standard deviation of the translation between the two, metres.
/// @param reach largest distance by which sigma widens the search, metres.
double expected_overlap(const Coarse& a, const Coarse& b, const pose_graph::Pose& b_from_a,
                        double sigma, double reach);

}  // namespace gpureg::loop_closure
