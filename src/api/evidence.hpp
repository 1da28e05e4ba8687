// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/result.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

/// How well the inliers of a mode determine it: the point-to-plane information about their centre,
/// rotation before translation, lengths in `unit`. Directions are those of the fixed cloud.
struct InformationSpectrum {
  Eigen::Vector3d centre;  ///< from where the moved cloud's local origin is
  double unit;
  Eigen::Matrix<double, 6, 1> values;   ///< ascending
  Eigen::Matrix<double, 6, 1> softest;  ///< direction of the first, a unit vector
};
InformationSpectrum spectrum_of(const ModeOutcome& mode, const PreparedState& moved);

/// The counts of a mode as shares. moved, fixed: the clouds as the engine had them; swapped: moved
/// is the caller's target.
PoseEvidence to_evidence(const PairOutcome& outcome, const ModeOutcome& mode,
                         const PreparedState& moved, const PreparedState& fixed, bool swapped);

}  // namespace gpureg
