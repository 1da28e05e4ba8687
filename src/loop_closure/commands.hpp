// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "loop_closure/state.hpp"

/// What the host's calls do to the state, once process() takes them over. The ids are valid.
namespace gpureg::loop_closure {

void add_fragment(State& state, const Fragment& fragment, const Options& options);
void add_odometry(State& state, const Odometry& odometry);
/// Connects new fragments of sessions without odometry of the host: by their poses.
void imply_odometry(State& state, const Options& options);
void add_covisible(State& state, FragmentId id, const std::vector<FragmentId>& others);
void add_proposal(State& state, Proposal proposal);
void add_record(State& state, LoopRecord record);
void set_estimates(State& state, const std::vector<FragmentPose>& poses);

/// Takes a fragment out of the graph. Its best-known neighbour takes over its other edges, each
/// composed with the edge to that neighbour: what the edges knew about pairs of neighbours stays,
/// exactly (to first order) where the fragment has two neighbours, and without more certainty than
/// there was where it has more.
void remove_fragment(State& state, FragmentId id);

}  // namespace gpureg::loop_closure
