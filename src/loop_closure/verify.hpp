// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include "loop_closure/state.hpp"

namespace gpureg::loop_closure {

struct Verification {
  pose_graph::Status status = pose_graph::Status::converged;
  std::string reason;

  /// false: the graph was not optimised, and the loops are as before.
  bool decided() const {
    return status != pose_graph::Status::failed && status != pose_graph::Status::cancelled;
  }
};

/// Optimises the graph over all poses of the loops, decides which loops are accepted, and, where
/// Options::optimize says so, moves the estimates. Sets state and reason of every loop, and
/// State::graph_changed to false. Where nothing is decided or it throws, the state stays as it was.
/// @param should_stop polled before every linear system; true: nothing is decided. May be empty.
Verification verify_loops(State& state, const Options& options,
                          const std::function<bool()>& should_stop);

/// Nodes, odometry and accepted loops.
pose_graph::Graph accepted_graph(const State& state, const Options& options);

}  // namespace gpureg::loop_closure
