// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/prepared_state.hpp"

namespace gpureg::confidence {

/// Perturbed poses of the most likely mode of each pair: moved both ways along its weakest
/// direction, as refinement may stop at several locations along it. An undecided mode is perturbed
/// by a quarter, half, three quarters and all of evidence.degeneracy_search_distance, as is a
/// confident one on a model; another confident one by all of it, and one with log odds below -5 not
/// at all. Takes about 50 us per pair, distributed over at most `threads` threads.
std::vector<PosesOfPair> search_degeneracies(Span<const PairInput> pairs,
                                             Span<const PairOutcome> outcomes,
                                             const RegistrationSettings& options,
                                             std::size_t threads);

}  // namespace gpureg::confidence
