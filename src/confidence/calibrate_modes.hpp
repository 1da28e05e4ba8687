// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "confidence/confidence.hpp"
#include "settings/settings.hpp"

namespace gpureg::confidence {

/// Calibrates the confidences of one pair's modes. At most one of the poses is correct, before and
/// after: the calibration maps the probability of the first mode with its equivalents, which share
/// it as before. The other modes keep their ratio to the first one as far as the sum of all stays
/// at most 1. The identity changes no bit.
/// @param modes the most confident first.
/// @param equivalent whether the clouds cannot tell the mode from the first one; that of the first
///   one itself does not matter.
void calibrate_modes(const ConfidenceCalibration& calibration, const std::vector<bool>& equivalent,
                     std::vector<ModeConfidence>& modes);

}  // namespace gpureg::confidence
