// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "loop_closure/state.hpp"

namespace gpureg::loop_closure {

/// Adds what is due to the queue, and takes from it what the graph has made superfluous. Where it
/// throws, the state stays as it was.
void refresh_proposals(State& state, const Options& options);

/// The next `count` proposals, fewer where there are fewer.
std::vector<Proposal> next_proposals(const State& state, std::size_t count);

/// Removes them from the queue.
void drop_proposals(State& state, std::size_t count);

}  // namespace gpureg::loop_closure
