// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "confidence/features.hpp"

namespace gpureg {
struct PreparedState;
}

/// From the evidence of a pair's modes to probabilities, by logistic regressions. `log` and `exp`
/// appear here and nowhere before.
namespace gpureg::confidence {

/// Log odds of each mode by its own evidence, which rank the modes of a pair.
std::vector<double> rank_modes(const std::vector<PoseEvidence>& modes, AvailableEvidence available);

/// Poses of a pair in the order of their likelihood.
struct Ranking {
  AvailableEvidence available;
  std::vector<double> log_odds;    ///< of each pose, from rank_modes()
  std::vector<std::size_t> order;  ///< indices of the poses, the most likely first
};

/// @param modes of the pair of the two clouds.
Ranking ranking_of(const std::vector<PoseEvidence>& modes, const PreparedState& source,
                   const PreparedState& target);

/// Which of two poses of a scan on its model that lie close together fits better: the one with more
/// normal-weighted overlap. The ranking counts points near the model whatever their normals, which
/// are as many when the ground lies a voxel too low, on the wrong side of its surface.
bool fits_model_better(const PoseEvidence& a, const PoseEvidence& b);

/// Number of overlapping points of the side with fewer of them, and the points of that side.
struct OverlapCount {
  std::uint32_t points, of;
};

/// Factor on the confidence of poses under which few points overlap. The regressions were fitted to
/// clouds of thousands of points.
double factor_of(OverlapCount overlap);

/// A mode that takes part in the verdict on its pair.
struct RankedMode {
  PoseEvidence evidence;
  double log_odds;       ///< from rank_modes()
  OverlapCount overlap;  ///< under its pose
};

struct ModeConfidence {
  double confidence;          ///< probability that the pose is correct
  double overlap_confidence;  ///< that it is correct and the clouds overlap by 30 % or more
};

/// Confidence of each mode in view of the others. Of distinct poses at most one is correct, so
/// modes with equal evidence share the probability.
/// @param modes distinct, in descending order of their log odds.
/// @param refined see add_rank().
std::vector<ModeConfidence> confidences_of(const std::vector<RankedMode>& modes,
                                           AvailableEvidence available, std::uint32_t refined);

}  // namespace gpureg::confidence
