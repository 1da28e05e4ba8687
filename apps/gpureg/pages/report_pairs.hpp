// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "records/result_file.hpp"

namespace gpureg::cli {

/// A pair compared with the ground truth. The protocol evaluates only pairs with j - i > 1.
struct EvaluatedPair {
  const PairRecord* pair = nullptr;
  bool in_truth = false;  ///< listed in gt.log: overlap >= 30 %
  /// Its pose, reported or not, is within 0.2 m of the ground truth. With gt_all.log this includes
  /// pairs that overlap by less than 30 %.
  bool correct = false;
};
std::vector<EvaluatedPair> evaluate_pairs(const evaluation::GroundTruth& truth,
                                          const ResultFile& result);

/// Adds to each rule of to_json(Evaluation) a "curve": [recall, precision] for a falling least
/// confidence.
void add_curves(Json& evaluation, const evaluation::GroundTruth& truth, const ResultFile& result);

/// A pair to draw, with its caption.
struct SamplePair {
  const PairRecord* pair = nullptr;
  std::string heading, caption;
};

/// Correct, false positive and missed pairs, at most `each` of a kind.
std::vector<SamplePair> samples(const ResultFile& result,
                                const std::vector<EvaluatedPair>& evaluated, std::size_t each);
/// Without ground truth: at most `most` pairs by falling confidence, from the first to the last.
std::vector<SamplePair> samples(const ResultFile& result, std::size_t most);

}  // namespace gpureg::cli
