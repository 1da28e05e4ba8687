// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace gpureg::reconstruction {

/// What two scans say about a pose that a map implies. The worse side counts.
struct ImpliedPairEvidence {
  double confidence = 0;  ///< of the pose alone
  double shared = 0;      ///< share of the points at the other scan's surfaces, any normal
  double violation = 0;   ///< share in free space of the points in view
  double violating = 0;   ///< share in free space of all points
};

/// log(p(evidence, correct pose) / p(evidence, wrong pose)). Monotone in every term: additive and
/// piecewise linear, constant beyond the values of the fit.
double log_likelihood_ratio(const ImpliedPairEvidence& evidence);

}  // namespace gpureg::reconstruction
