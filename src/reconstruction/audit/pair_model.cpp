// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/audit/pair_model.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include "math/exponential.hpp"
#include "reconstruction/audit/pair_model_table.hpp"

namespace gpureg::reconstruction {
namespace {

/// The logarithms are of at least these shares: less is noise. Confidences, and their opposites,
/// count as at least kLeastPairConfidence.
constexpr double kLeastPairConfidence = 1e-4, kLeastViolation = 0.003, kLeastViolating = 0.001;
/// A low confidence says nothing where hardly a point lies at the other scan's surfaces, and all
/// that it can where this share does: right poses with less have low confidences, too.
constexpr double kEnoughShared = 0.25;

std::array<double, kPairFeatures> features_of(const ImpliedPairEvidence& e) {
  const double confidence =
      std::clamp(e.confidence, kLeastPairConfidence, 1 - kLeastPairConfidence);
  const double log_odds = portable::log(confidence / (1 - confidence));
  std::array<double, kPairFeatures> out{};
  const auto set = [&](PairFeature feature, double value) {
    out[static_cast<std::size_t>(feature)] = value;
  };
  set(PairFeature::coincide, std::max(log_odds, 0.0));
  set(PairFeature::doubt, std::min(log_odds, 0.0) * std::min(e.shared / kEnoughShared, 1.0));
  set(PairFeature::no_violation, -portable::log(std::max(e.violation, kLeastViolation)));
  set(PairFeature::none_violating, -portable::log(std::max(e.violating, kLeastViolating)));
  return out;
}

}  // namespace

double log_likelihood_ratio(const ImpliedPairEvidence& evidence) {
  const std::array<double, kPairFeatures> x = features_of(evidence);
  double sum = kPairBias;
  for (const PairStep& s : kPairSteps)
    sum += s.rise * std::clamp((x[static_cast<std::size_t>(s.feature)] - s.from) / (s.to - s.from),
                               0.0, 1.0);
  return sum;
}

}  // namespace gpureg::reconstruction
