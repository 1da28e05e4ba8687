// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

/// A logistic regression.
struct Regression {
  Features weights;
  double bias;

  /// Logarithm of the odds. Summed in the order of the features, so that the bits are always the
  /// same.
  double log_odds(const Features& x) const {
    double sum = bias;
    for (std::size_t k = 0; k < kFeatureCount; ++k) sum += weights[k] * x[k];
    return sum;
  }
};

/// The regressions for one kind of available evidence.
struct ConfidenceModel {
  Regression ranking;     ///< of the modes of a pair
  Regression confidence;  ///< the pose is correct
  Regression overlap;     ///< the pose is correct and the clouds overlap by 30 % or more
};

}  // namespace gpureg::confidence
