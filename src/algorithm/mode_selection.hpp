// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>

#include "algorithm/evidence.hpp"
#include "common/limits.hpp"
#include "settings/settings.hpp"

namespace gpureg {

/// Which candidates become modes: the best by their coarse score that are distinct, at most `most`.
/// Those after the first `certain` need a score of at least `least` and `share_of_best` of the
/// highest one. Most pairs of a set share nothing and have low scores only, so the limits take most
/// of the work away; places that look alike have many high scores and keep their modes.
struct ModeSelection {
  ModeLimits within;
  std::uint32_t most, certain;
  float least, share_of_best;
};

/// Score that a mode after the first `certain` needs.
GPUREG_HD float least_score(const ModeSelection& selection, float best) {
  const float share = selection.share_of_best * best;
  return share > selection.least ? share : selection.least;
}

// Chosen by a sweep over houses, a hospital, a kitchen, offices and warehouses: the smallest effort
// that keeps the recall of the first mode everywhere and raises that of all modes in offices.
/// The first refinement takes so many times the modes of the options: it moves a third of them to
/// the same poses, and a score after it tells more than one before.
constexpr std::uint32_t kRefinedPerMode = 2;
/// Coarse scores below it have hardly ever been correct beyond the first few modes.
constexpr float kLeastScore = 0.01f;
/// Correct poses score a tenth of a perceptual alias where the clouds overlap little.
constexpr float kLeastShareOfBest = 0.1f;
constexpr std::uint32_t kCertainFirst = 16, kCertainSecond = 6;

/// Host only. The modes of the first refinement.
inline ModeSelection first_selection(const EvidenceSettings& options) {
  return {mode_limits(options.mode_angle, options.mode_distance, 1.0f),
          std::min(kRefinedPerMode * options.modes, limits::kMaxModes), kCertainFirst, kLeastScore,
          0.0f};
}

/// Host only. The modes of the second refinement, by their scores after the first.
inline ModeSelection second_selection(const EvidenceSettings& options) {
  return {mode_limits(options.mode_angle, options.mode_distance, kRoughMerge), options.modes,
          kCertainSecond, kLeastScore, kLeastShareOfBest};
}

/// Iterations of the first refinement at most: the second goes on from there.
constexpr std::uint32_t kRoughIterations = 10;
/// Iterations on all points at most, after the narrow kernel has settled on a sample.
constexpr std::uint32_t kFinalIterations = 3;

/// Points of the source in a refinement on a sample, approximately.
inline std::uint32_t refinement_sample(const EvidenceSettings& options) {
  return 2 * options.sample;
}

/// The pose in single precision.
GPUREG_HD Pose<float> narrow(const Pose<double>& p) {
  return {static_cast<float>(p.w), static_cast<float>(p.x),  static_cast<float>(p.y),
          static_cast<float>(p.z), static_cast<float>(p.tx), static_cast<float>(p.ty),
          static_cast<float>(p.tz)};
}

}  // namespace gpureg
