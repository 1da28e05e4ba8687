// SPDX-License-Identifier: BSD-3-Clause
#include "confidence/calibrate_modes.hpp"

#include <algorithm>

namespace gpureg::confidence {

void calibrate_modes(const ConfidenceCalibration& calibration, const std::vector<bool>& equivalent,
                     std::vector<ModeConfidence>& modes) {
  if (calibration.is_identity() || modes.empty()) return;
  const auto in_group = [&](std::size_t k) { return k == 0 || equivalent[k]; };
  double group = 0, others = 0;
  bool alone = true;
  for (std::size_t k = 0; k < modes.size(); ++k) {
    (in_group(k) ? group : others) += modes[k].confidence;
    alone &= k == 0 || !equivalent[k];
  }
  if (group <= 0) return;
  const double mapped = calibration(std::min(group, 1.0)), scale = mapped / group;
  const double other_scale = others * scale > 1.0 - mapped ? (1.0 - mapped) / others : scale;
  for (std::size_t k = 0; k < modes.size(); ++k) {
    ModeConfidence& mode = modes[k];
    const double before = mode.confidence;
    if (before <= 0) continue;
    // A ratio would round.
    mode.confidence = k == 0 && alone ? mapped : before * (in_group(k) ? scale : other_scale);
    mode.confidence = std::min({mode.confidence, modes.front().confidence, 1.0});
    mode.overlap_confidence =
        std::min(mode.confidence, mode.overlap_confidence * (mode.confidence / before));
  }
}

}  // namespace gpureg::confidence
