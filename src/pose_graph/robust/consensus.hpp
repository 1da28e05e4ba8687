// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "pose_graph/problem.hpp"

namespace gpureg::pose_graph {

/// What short cycles say about the loops of a problem.
struct Consensus {
  /// Per edge: the mode that most others agree with.
  std::vector<int> modes;
  /// Per edge: probability that this mode is correct, from its confidence and the agreement.
  std::vector<double> probability;
  /// Per edge: number of loops in the set that it belongs to, where two loops are in one set if
  /// they agree. 1: it agrees with none.
  std::vector<int> cluster_size;
  int largest_cluster = 0;
};

/// Closes cycles of two loops over a few odometry edges, and of three loops. A cycle speaks for its
/// loops by the ratio of two probability densities of its misclosure: under the covariances, and
/// under poses drawn uniformly from the extent of the loops (compare the pairwise consistency of
/// Mangelson et al. 2018).
Consensus find_consensus(const Problem& problem, double quantile, int threads);

}  // namespace gpureg::pose_graph
