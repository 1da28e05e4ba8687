// SPDX-License-Identifier: BSD-3-Clause
#include "confidence/confidence.hpp"

#include <algorithm>
#include <cmath>

#include "confidence/confidence_model.hpp"

namespace gpureg::confidence {
namespace {

/// Bounds the log odds as features: beyond, modes are certain one way or the other.
constexpr double kMaxLogOdds = 14;

const ConfidenceModel& model_of(AvailableEvidence available) {
  if (available.free_space) return available.surface_sides ? kFreeSpaceAndSurfaceSides : kFreeSpace;
  return available.surface_sides ? kSurfaceSides : kOverlapAlone;
}

double probability(double log_odds) { return 1.0 / (1.0 + std::exp(-log_odds)); }

/// Probabilities of modes of which exactly one is correct, by their odds alone.
std::vector<double> shares_of(const std::vector<RankedMode>& modes) {
  const auto less = [](const RankedMode& a, const RankedMode& b) {
    return a.log_odds < b.log_odds;
  };
  const double most = std::max_element(modes.begin(), modes.end(), less)->log_odds;
  double sum = 0;
  std::vector<double> out;
  for (const RankedMode& mode : modes) {
    out.push_back(std::exp(mode.log_odds - most));
    sum += out.back();
  }
  for (double& share : out) share /= sum;
  return out;
}

/// Factor for small clouds. The regressions were fitted to clouds of thousands of points; some pose
/// of any two clouds makes a few points overlap. Measured on rooms in voxels of 10 cm to 1 m
/// (bench/accuracy/few_points.py): poses with 200 and more overlapping points are correct as often
/// as the regression says, with 100 three times in four of that, with 20 hardly ever.
double factor_of(OverlapCount overlap) {
  constexpr double kFewPoints = 80, kSmallCloud = 1500;
  const double n = overlap.points / kFewPoints * std::max(1.0, overlap.of / kSmallCloud);
  return 1.0 - std::exp(-n * n);
}

}  // namespace

std::vector<double> rank_modes(const std::vector<PoseEvidence>& modes,
                               AvailableEvidence available) {
  const Regression& ranking = model_of(available).ranking;
  std::vector<double> out;
  for (const PoseEvidence& evidence : modes)
    out.push_back(ranking.log_odds(features_of(evidence, available, Regressand::ranking)));
  return out;
}

std::vector<ModeConfidence> confidences_of(const std::vector<RankedMode>& modes,
                                           AvailableEvidence available, std::uint32_t refined) {
  std::vector<ModeConfidence> out;
  if (modes.empty()) return out;
  const ConfidenceModel& model = model_of(available);
  const auto bounded = [&](std::size_t k) {
    return std::clamp(modes[k].log_odds, -kMaxLogOdds, kMaxLogOdds);
  };
  const std::vector<double> share = shares_of(modes);
  const double distinct = static_cast<double>(modes.size()) / refined;
  for (std::size_t k = 0; k < modes.size(); ++k) {
    const double alternative = k > 0 ? bounded(0) : modes.size() > 1 ? bounded(1) : -kMaxLogOdds;
    Features x = features_of(modes[k].evidence, available, Regressand::confidence);
    x[static_cast<std::size_t>(Feature::log_odds)] = bounded(k);
    x[static_cast<std::size_t>(Feature::margin)] = bounded(k) - alternative;
    x[static_cast<std::size_t>(Feature::distinct_share)] = distinct;
    ModeConfidence mode{probability(model.confidence.log_odds(x)),
                        probability(model.overlap.log_odds(x))};
    mode.confidence = std::min(mode.confidence, share[k]) * factor_of(modes[k].overlap);
    if (k > 0) mode.confidence = std::min(mode.confidence, out.front().confidence);
    mode.overlap_confidence = std::min(mode.overlap_confidence, mode.confidence);
    out.push_back(mode);
  }
  return out;
}

}  // namespace gpureg::confidence
