// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "loop_closure/paths.hpp"

namespace gpureg::loop_closure {

/// Fills in the drift ratio of the modes that lack it.
void compute_drift_ratios(State& state, const Paths& odometry, const Options& options);

UncertainPose uncertain(const Mode& mode);

/// Squared Mahalanobis distance of two estimates of one pose.
double squared_distance(const UncertainPose& a, const UncertainPose& b);

/// true: the mode may take part in the graph.
bool within_drift(const Mode& mode, const Options& options);

/// What becomes of a loop that takes part in the graph.
struct Verdict {
  bool accepted = false;
  LoopReason reason = LoopReason::unconfirmed;
};

/// Accepts loops that are confident and within the drift of odometry, and loops that independent
/// ones confirm: loops of other fragments that, with the odometry between their ends, predict the
/// same relative pose, much better than odometry alone does.
/// Needs State::relations.
/// @param fits one per loop of the state: the robust graph accepts it.
/// @param joined in and out, one per loop: it fitted the graph together with loops that join its
///   frames, and is not confident enough itself. As long as loops that it agrees with fit, it
///   confirms them.
/// @param scale place in kDriftScales.
std::vector<Verdict> accept_loops(const State& state, const Paths& odometry,
                                  const std::vector<char>& fits, std::uint8_t scale,
                                  const Options& options, std::vector<char>& joined);

}  // namespace gpureg::loop_closure
