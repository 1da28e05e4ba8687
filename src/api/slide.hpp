// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/engine.hpp"

namespace gpureg {

/// The likeliest mode of a pair, moved both ways along the direction that its inliers determine
/// least: where to look further, see FurtherSearch. There refinement also stops at what is not the
/// best place within reach. Where evidence leaves it open whether the mode is right, by a quarter,
/// half, three quarters and all of evidence.slide_distance; where it is sure, by the whole; where
/// it is hopeless, not.
FurtherPoses slide(const PairInput& pair, const PairOutcome& outcome,
                   const RegistrationOptions& options);

}  // namespace gpureg
