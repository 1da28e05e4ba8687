// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "json/json.hpp"
#include "records/result_file.hpp"

namespace gpureg::cli {

/// JSON of scores, as `evaluate --json` writes it.
Json to_json(const evaluation::Evaluation& evaluation);

/// Every pair with j - i > 1 that the result tried or the truth lists, beside the truth, in order
/// of i and j: `listed` (in gt.log), `known` (in gt.log or gt_all.log), `tried`, `reported`,
/// scores, and for poses of known pairs Redwood's error in metres and the errors of rotation
/// (degrees) and translation (metres); `strict` and `geometric`: right under the rule. What is not
/// known is null.
Json pair_verdicts(const evaluation::GroundTruth& truth, const ResultFile& result);

/// Registration recall as 3DMatch's users count it: of all pairs of a log, consecutive ones too,
/// the share whose best candidate, reported or not, is within 15 degrees and 0.30 m (rotation and
/// translation of T_ij). Throws IoError.
struct RegistrationRecall {
  int right = 0, pairs = 0, tried = 0;
  double recall() const { return pairs ? static_cast<double>(right) / pairs : 0; }
};
RegistrationRecall registration_recall(const std::string& truth_log, const ResultFile& result);

}  // namespace gpureg::cli
