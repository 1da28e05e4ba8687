// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gpureg/pose_graph/graph.hpp"

namespace gpureg::pose_graph {

enum class Status {
  converged,       ///< the poses are a minimum of the objective
  max_iterations,  ///< the poses are better than the initial ones, but not yet a minimum
  cancelled,       ///< should_stop said so; the poses are those reached by then
  no_nodes,        ///< the graph is empty
  failed           ///< the linear systems could not be solved; the reason says where
};

/// "converged", ...
const char* to_string(Status status);

enum class EdgeState { accepted, rejected };

/// What became of one edge.
struct EdgeResult {
  EdgeState state = EdgeState::rejected;
  double weight = 0;  ///< in [0, 1]; 1 for odometry
  /// The mode that fits best: 0 is the edge itself, k > 0 is alternatives[k - 1].
  std::uint32_t mode = 0;
  double squared_error = 0;  ///< e' * information * e of that mode at the result
};

/// A set of nodes that odometry and accepted loops connect.
struct Component {
  std::vector<std::int64_t> nodes;  ///< ids, ascending
  /// The node whose pose was held if nothing else holds the component in the world: neither a
  /// fixed node nor a prior. The poses are then in a frame of the component's own.
  bool own_frame = true;
  std::int64_t anchor = 0;  ///< its id; the smallest fixed node or the smallest node otherwise
};

/// Marginal covariance of one node, of Log(estimate^-1 * truth): rotation first, the node's frame.
struct Marginal {
  std::int64_t node = 0;
  UnalignedMatrix6d covariance = UnalignedMatrix6d::Zero();
};

/// Result of optimize(). A plain value.
struct Result {
  Status status = Status::no_nodes;
  std::string reason;  ///< one sentence; empty when converged
  /// Poses in the order of Graph::nodes.
  std::vector<UnalignedIsometry3d> world_from_node;
  std::vector<EdgeResult> edges;      ///< in the order of Graph::edges
  std::vector<Component> components;  ///< by smallest node id
  std::vector<Marginal> marginals;    ///< in the order of Options::marginals
  int iterations = 0;                 ///< linear systems solved
  /// Half the sum of squared errors, a loop's capped at its threshold (gnc) or in the line
  /// process's form.
  double initial_cost = 0;
  double final_cost = 0;

  bool converged() const { return status == Status::converged; }
  std::size_t accepted_loops(const Graph& graph) const;
};

}  // namespace gpureg::pose_graph
