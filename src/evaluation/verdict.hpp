// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/evaluation.hpp"

/// Shared parts of the strict and the geometric rule. Private to the library.
namespace gpureg::evaluation {

/// Only these pairs count: consecutive fragments are the task of odometry.
inline bool counts(int i, int j) { return static_cast<long long>(j) - i > 1; }

/// One report under one rule.
struct Verdict {
  double score = 1;  ///< ranks, by the rule
  bool reported = true;
  bool good = false;         ///< right under the rule
  bool good_recall = false;  ///< right, and one of gt.log's pairs
};

/// Ranks all verdicts, reported or not. ground_truth: gt.log's pairs that count. Throws
/// InvalidArgument for a score that is NaN.
RankedScores rank(std::vector<Verdict> verdicts, int ground_truth);

}  // namespace gpureg::evaluation
