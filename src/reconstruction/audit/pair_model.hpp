// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace gpureg::reconstruction {

/// What two scans say about a pose that a map implies.
struct ImpliedPairEvidence {
  double confidence = 0;  ///< of the pose alone
  /// Larger share of the points of one scan at the other's surfaces, any normal.
  double shared = 0;
  /// Of the scan that is worse off in free space: share there of its points in view.
  double violation = 0;
  double violating = 0;  ///< share there of all its points
};

/// log(p(evidence, correct pose) / p(evidence, wrong pose)). Monotone in every term: additive and
/// piecewise linear, constant beyond the values of the fit.
double log_likelihood_ratio(const ImpliedPairEvidence& evidence);

}  // namespace gpureg::reconstruction
