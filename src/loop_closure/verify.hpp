// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "loop_closure/state.hpp"

namespace gpureg::loop_closure {

struct Verification {
  pose_graph::Status status = pose_graph::Status::converged;
  std::string reason;
};

/// Optimises the graph over all poses of the loops, decides which loops are accepted, and, where
/// Options::optimize says so, moves the estimates. Sets state and reason of every loop.
Verification verify_loops(State& state, const Options& options);

/// Nodes, odometry and accepted loops.
pose_graph::Graph accepted_graph(const State& state, const Options& options);

}  // namespace gpureg::loop_closure
