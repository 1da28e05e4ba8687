// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "pose_graph/problem.hpp"

namespace gpureg::pose_graph {

/// Poses along the most certain paths from the nodes in `known`: Dijkstra's algorithm on (edges
/// that are not trusted, sum of variances). Odometry is always trusted; trusted holds a flag per
/// edge. Nodes that no path reaches keep their pose.
void poses_from_paths(const Problem& problem, const std::vector<char>& known,
                      const std::vector<char>& trusted, const std::vector<int>& modes,
                      std::vector<Pose>& poses);

/// Rotates a component about its anchor so that its gravity factors agree with the world's up as
/// well as one rotation can make them.
void align_with_gravity(const Problem& problem, int anchor, std::vector<Pose>& poses);

/// Moves a component rigidly so that its first prior is met.
void align_with_prior(const Problem& problem, std::vector<Pose>& poses);

}  // namespace gpureg::pose_graph
