// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "loop_closure/state.hpp"

namespace gpureg::loop_closure {

/// What a registration says about a pair: its modes from the confidence that takes part.
LoopRecord record_of(FragmentId source, FragmentId target, const RegistrationResult& result,
                     const Options& options);

/// Registers the proposals; one result each. Throws what align_batch() throws; state is not
/// touched.
std::vector<RegistrationResult> register_all(const Context& context, const State& state,
                                             const std::vector<Proposal>& proposals,
                                             const Options& options);

}  // namespace gpureg::loop_closure
