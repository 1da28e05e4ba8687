// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/result.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

/// What the caller gets: the outcome in the clouds' own frames. swapped: source and target changed
/// places for the engine.
RegistrationResult to_result(const PairOutcome& outcome, const PreparedState& source,
                             const PreparedState& target, bool swapped,
                             const RegistrationOptions& options, const PriorTest& prior = {});

}  // namespace gpureg
