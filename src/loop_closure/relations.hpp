// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "loop_closure/paths.hpp"

namespace gpureg::loop_closure {

/// Fills in State::relations of the modes that lack them: which loops near each other, along the
/// odometry, agree and which contradict each other. Two loops and the odometry between their ends
/// are a cycle; its misclosure is compared with its covariance (compare Mangelson et al. 2018).
void update_relations(State& state, const Paths& odometry, const Options& options);

/// By how much odometry drifts more than its options say: the smallest of kDriftScales, as its
/// place, under which nearly as many independent loops agree as under the largest. Loops near each
/// other agree whatever the misclosure that they close.
std::uint8_t drift_scale(const State& state);

/// Of the loops in `fits`, those that contradict more than agrees with them, weighted by
/// confidence: removed until no two of the rest contradict each other.
std::vector<char> contradicted(const State& state, const std::vector<char>& fits,
                               std::uint8_t scale);

}  // namespace gpureg::loop_closure
