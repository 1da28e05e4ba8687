// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "result_file.hpp"

namespace gpureg::cli {

/// A pair next to the truth. Only pairs with j - i > 1 are judged, as in the protocol.
struct EvaluatedPair {
  const PairRecord* pair = nullptr;
  bool in_truth = false;  ///< overlap >= 30 %: it ought to be found
  /// its pose, reported or not, is within 0.2 m of the truth (of any overlap, where gt_all is
  /// there)
  bool right = false;
};
std::vector<EvaluatedPair> judge(const evaluation::GroundTruth& truth, const ResultFile& result);

/// Recall and precision while the threshold falls; geometric: by the geometric rule, which the
/// truth must allow.
std::vector<std::pair<double, double>> recall_precision(const evaluation::GroundTruth& truth,
                                                        const ResultFile& result, bool geometric);

/// A pair worth a picture, and why.
struct SamplePair {
  const PairRecord* pair = nullptr;
  std::string heading, remark;
};

/// With truth: right, wrong and missed pairs, the telling ones; without: sure, narrow and rejected
/// ones. At most `each` of a kind.
std::vector<SamplePair> samples(const std::vector<EvaluatedPair>& judged, std::size_t each);
std::vector<SamplePair> samples(const ResultFile& result, std::size_t each);

}  // namespace gpureg::cli
