// SPDX-License-Identifier: BSD-3-Clause
#include "confidence/confidence.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "confidence/confidence_model.hpp"
#include "math/exponential.hpp"
#include "pipeline/prepared_state.hpp"

namespace gpureg::confidence {
namespace {

const ConfidenceModel& model_of(AvailableEvidence available) {
  if (available.model) return kModel;
  if (available.flat) return available.free_space ? kFlat : kFlatSurfaceSides;
  if (available.free_space) return available.surface_sides ? kFreeSpaceAndSurfaceSides : kFreeSpace;
  return available.surface_sides ? kSurfaceSides : kOverlapAlone;
}

/// Probabilities of modes of which exactly one is correct, by their odds alone.
std::vector<double> shares_of(const std::vector<RankedMode>& modes) {
  const auto less = [](const RankedMode& a, const RankedMode& b) {
    return a.log_odds < b.log_odds;
  };
  const double most = std::max_element(modes.begin(), modes.end(), less)->log_odds;
  double sum = 0;
  std::vector<double> out;
  for (const RankedMode& mode : modes) {
    out.push_back(portable::exp(mode.log_odds - most));
    sum += out.back();
  }
  for (double& share : out) share /= sum;
  return out;
}

}  // namespace

double factor_of(OverlapCount overlap) {
  // Some pose of any two clouds makes a few points overlap. Measured on rooms in voxels of 10 cm to
  // 1 m (bench/results/few_points.json): poses with 200 and more overlapping points are correct as
  // often as the regression says, with 100 three times in four of that, with 20 hardly ever. In
  // larger clouds, where the fits know the worth of small shares, a point counts more.
  constexpr double kFewPoints = 80, kSmallCloud = 1500;
  const double n = overlap.points / kFewPoints * std::max(1.0, overlap.of / kSmallCloud);
  return 1.0 - portable::exp(-n * n);
}

std::vector<double> rank_modes(const std::vector<PoseEvidence>& modes,
                               AvailableEvidence available) {
  const Regression& ranking = model_of(available).ranking;
  std::vector<double> out;
  for (const PoseEvidence& evidence : modes)
    out.push_back(ranking.log_odds(features_of(evidence, available, Regressand::ranking)));
  return out;
}

Ranking ranking_of(const std::vector<PoseEvidence>& modes, const PreparedState& source,
                   const PreparedState& target) {
  Ranking out;
  out.available =
      available_evidence(modes, source.statistics.viewpoint, target.statistics.viewpoint);
  out.available.flat = planar_pair(source, target);
  out.log_odds = rank_modes(modes, out.available);
  out.order.resize(modes.size());
  std::iota(out.order.begin(), out.order.end(), std::size_t(0));
  std::stable_sort(out.order.begin(), out.order.end(),
                   [&](std::size_t a, std::size_t b) { return out.log_odds[a] > out.log_odds[b]; });
  return out;
}

bool fits_model_better(const PoseEvidence& a, const PoseEvidence& b) {
  const auto overlap = [](const PoseEvidence& e) {
    return std::max(e.source_normal_weighted_overlap, e.target_normal_weighted_overlap);
  };
  return overlap(a) > overlap(b);
}

std::vector<ModeConfidence> confidences_of(const std::vector<RankedMode>& modes,
                                           AvailableEvidence available, std::uint32_t refined) {
  std::vector<ModeConfidence> out;
  if (modes.empty()) return out;
  const ConfidenceModel& model = model_of(available);
  const std::vector<double> share = shares_of(modes);
  std::vector<double> log_odds;
  std::vector<Features> own;
  for (const RankedMode& mode : modes) {
    log_odds.push_back(mode.log_odds);
    own.push_back(features_of(mode.evidence, available, Regressand::confidence));
  }
  for (std::size_t k = 0; k < modes.size(); ++k) {
    Features x = own[k];
    add_rank(log_odds, own, k, refined, x);
    ModeConfidence mode{portable::logistic(model.confidence.log_odds(x)),
                        portable::logistic(model.overlap.log_odds(x))};
    mode.confidence = std::min(mode.confidence, share[k]) * factor_of(modes[k].overlap);
    if (k > 0) mode.confidence = std::min(mode.confidence, out.front().confidence);
    mode.overlap_confidence = std::min(mode.overlap_confidence, mode.confidence);
    out.push_back(mode);
  }
  return out;
}

}  // namespace gpureg::confidence
