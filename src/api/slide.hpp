// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/engine.hpp"

namespace gpureg {

/// The likeliest mode of a pair, moved by evidence.slide_distance and by half of it, both ways, along the direction that its inliers
/// determine least: where to look further, see FurtherSearch. There refinement also stops at what is not the best place within reach.
FurtherPoses slide(const PairInput& pair, const PairOutcome& outcome, const RegistrationOptions& options);

}  // namespace gpureg
