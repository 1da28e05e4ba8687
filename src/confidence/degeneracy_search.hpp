// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/prepared_state.hpp"

namespace gpureg::confidence {

/// Perturbed poses of the most likely mode of each pair: moved both ways along the direction that
/// its inliers determine least, as refinement may stop at several places along it. Where the
/// evidence leaves open whether the mode is correct, by a quarter, half, three quarters and all of
/// evidence.degeneracy_search_distance; where it is confident, by all of it; where the mode is
/// hopeless, not at all. Takes some 50 us a pair, spread over at most that many threads.
std::vector<PosesOfPair> search_degeneracies(Span<const PairInput> pairs,
                                             Span<const PairOutcome> outcomes,
                                             const RegistrationOptions& options,
                                             std::size_t threads);

}  // namespace gpureg::confidence
