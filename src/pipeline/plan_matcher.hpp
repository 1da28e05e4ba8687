// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "algorithm/plan.hpp"

namespace gpureg {

/// Places of scans in one map from above, in the memory of an engine, which has to outlive it.
/// Thread-safe.
class PlanMatcher {
 public:
  virtual ~PlanMatcher() = default;
  /// The coarse cells and headings with the highest scores, at most `most` of each scan, the best
  /// first; equal ones by heading, row and column. Where too many share a score, none of them.
  virtual std::vector<std::vector<plan::Place>> best_cells(Span<const plan::Scan> scans,
                                                           std::size_t most) = 0;
  /// The best cell, and heading in half the step, around each coarse place: the first of equal ones
  /// by heading, row and column.
  virtual std::vector<std::vector<plan::Place>> refine(
      Span<const plan::Scan> scans, const std::vector<std::vector<plan::Place>>& coarse) = 0;
};

}  // namespace gpureg
