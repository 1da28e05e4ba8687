// SPDX-License-Identifier: BSD-3-Clause
#include "localization/find/part_confidence.hpp"

#include <algorithm>

#include "localization/find/part_confidence_model.hpp"
#include "math/exponential.hpp"

namespace gpureg::localization {
namespace {

constexpr double kLeast = 1e-6;  // of what a logarithm is taken of

double log_of(double x) { return portable::log(std::max(x, kLeast)); }

}  // namespace

std::array<double, kPartFeatures> part_features(const PartEvidence& e) {
  return {e.supported,
          e.violated,
          e.occluded,
          e.contour,
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
