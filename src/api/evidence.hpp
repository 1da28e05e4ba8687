// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/result.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

/// The counts of a mode as shares. moved, fixed: the clouds as the engine had them; swapped: moved is the caller's target.
PoseEvidence to_evidence(const PairOutcome& outcome, const ModeOutcome& mode, const PreparedState& moved, const PreparedState& fixed,
                         bool swapped);

}  // namespace gpureg
