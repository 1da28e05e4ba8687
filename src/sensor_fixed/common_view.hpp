// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pipeline/prepared_state.hpp"

namespace gpureg {

/// Two scans from one place see the same surfaces wherever both look. True for a pose that brings
/// the sensors of both clouds to one place although a third of what both observed is different: its
/// support is what is fixed to the sensor (the vehicle, the tripod, a hand).
/// @param mode pose of `moved` in `fixed`, with its evidence.
/// @param distance within which the sensors are at one place.
bool contradicts_common_view(const ModeOutcome& mode, const PreparedState& moved,
                             const PreparedState& fixed, double distance);

}  // namespace gpureg
