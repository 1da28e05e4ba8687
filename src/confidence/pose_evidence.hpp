// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "confidence/information.hpp"
#include "gpureg/evidence.hpp"

namespace gpureg::confidence {

inline bool without_overlap(const ModeOutcome& mode) {
  return mode.source[Term::inliers] == 0 && mode.target[Term::inliers] == 0;
}

/// Counts of a mode as shares. moved, fixed: the clouds in the engine; swapped: the moved cloud is
/// the target of the pair.
PoseEvidence evidence_of(const PairOutcome& outcome, const ModeOutcome& mode,
                         const InformationSpectrum& spectrum, const PreparedState& moved,
                         const PreparedState& fixed, bool swapped);

}  // namespace gpureg::confidence
