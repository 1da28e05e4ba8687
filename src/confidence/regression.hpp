// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>

#include "confidence/features.hpp"

namespace gpureg::confidence {

struct FeatureWeight {
  Feature feature;
  double weight;
};

/// Weights by feature; 0 for features that are not listed.
constexpr Features weights(std::initializer_list<FeatureWeight> list) {
  Features out{};
  for (const FeatureWeight& w : list) out[static_cast<std::size_t>(w.feature)] = w.weight;
  return out;
}

/// What a feature adds on its way from one value to another one. Before `from` it adds nothing,
/// from `to` on no more than `rise`: outside of the values that were fitted, nothing gets more
/// certain.
struct Step {
  Feature feature;
  double from, to, rise;
};

/// A logistic regression of an additive model: linear in some features, piecewise linear in others.
/// Where every step of a feature has the same sign, the odds are monotone in it.
struct Regression {
  Features weights;
  double bias;
  const Step* steps = nullptr;
  std::size_t step_count = 0;

  /// Logarithm of the odds. Summed in the order of the features and steps, so that the bits are
  /// always the same.
  double log_odds(const Features& x) const {
    double sum = bias;
    for (std::size_t k = 0; k < kFeatureCount; ++k) sum += weights[k] * x[k];
    for (std::size_t k = 0; k < step_count; ++k) {
      const Step& s = steps[k];
      const double value = x[static_cast<std::size_t>(s.feature)];
      sum += s.rise * std::clamp((value - s.from) / (s.to - s.from), 0.0, 1.0);
    }
    return sum;
  }
};

/// A regression of steps alone.
template <std::size_t n>
constexpr Regression additive(double bias, const Step (&steps)[n]) {
  return {Features{}, bias, steps, n};
}

/// The regressions for one kind of available evidence.
struct ConfidenceModel {
  Regression ranking;     ///< of the modes of a pair
  Regression confidence;  ///< the pose is correct
  Regression overlap;     ///< the pose is correct and the clouds overlap by 30 % or more
};

}  // namespace gpureg::confidence
