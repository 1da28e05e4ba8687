// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/engine.hpp"

namespace gpureg {

/// The likeliest mode of a pair, moved by evidence.slide_distance both ways along the direction that its inliers determine least: where
/// to look further, see FurtherSearch.
FurtherPoses slide(const PairInput& pair, const PairOutcome& outcome, const RegistrationOptions& options);

}  // namespace gpureg
