// SPDX-License-Identifier: BSD-3-Clause
#include "localization/find/part_confidence.hpp"

#include <algorithm>
#include <cmath>

#include "localization/find/part_confidence_model.hpp"
#include "math/exponential.hpp"

namespace gpureg::localization {
namespace {

constexpr double kLeast = 1e-6;  // of what a logarithm is taken of

/// Neighbouring pixels are judged by the same points of the scene: a block of so many along each
/// edge counts as one independent trial.
constexpr double kDependent = 2;

/// Lower bound of the probability behind a share of `count` independent trials, one standard
/// deviation (Wilson 1927).
double at_least(double share, double count) {
  if (!(count > 0)) return 0;
  const double half = 0.5 / count;
  return std::max(
      0.0, (share + half - std::sqrt(share * (1 - share) / count + half * half)) / (1 + 2 * half));
}

double log_of(double x) { return portable::log(std::max(x, kLeast)); }

}  // namespace

std::array<double, kPartFeatures> part_features(const PartEvidence& e) {
  const double edge = kDependent * e.cell;
  const double open = e.supported > 0 && edge > 0 ? e.area / e.supported / (edge * edge) : 0;
  const double outline = edge > 0 ? e.contour_length / edge : 0;
  return {at_least(e.supported, open),
          1 - at_least(1 - e.violated, open),
          e.occluded,
          at_least(e.contour, outline),
          e.contour_length,
          log_of(e.area),
          e.residual,
          log_of(e.weakest),
          log_of(e.third_weakest),
          log_of(static_cast<double>(e.votes)),
          e.rival};
}

double part_log_odds(const PartEvidence& evidence) {
  const std::array<double, kPartFeatures> x = part_features(evidence);
  const PartModel& model = evidence.viewpoint_known ? kInView : kUnseen;
  double sum = model.bias;
  for (std::size_t k = 0; k < model.size; ++k) {
    const PartStep& s = model.steps[k];
    const double value = x[static_cast<std::size_t>(s.feature)];
    sum += s.rise * std::clamp((value - s.from) / (s.to - s.from), 0.0, 1.0);
  }
  return sum;
}

double part_confidence(const PartEvidence& evidence) {
  return 1 / (1 + portable::exp(-part_log_odds(evidence)));
}

}  // namespace gpureg::localization
