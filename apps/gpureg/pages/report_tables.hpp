// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pages/report_pairs.hpp"
#include "records/result_file.hpp"

namespace gpureg::cli {

/// The value at a JSON pointer, strings without quotes; empty where there is none.
std::string text_of(const Json& json, const char* pointer);

/// The number at a JSON pointer; none where there is no number.
std::optional<double> number_of(const Json& json, const char* pointer);

/// A row of a table. tag: "td" or "th"; style: its class, empty for none. The texts are escaped.
std::string table_row(const std::vector<std::string>& texts, const char* tag,
                      const std::string& style = "");

/// What the table shows of the JSON of a pair; empty where that does not tell.
struct PairRow {
  std::string status, inlier_rmse, correspondences, survivors, scored, inliers;
};
PairRow pair_row(const Json& pair);

/// Parts of the page, each with its heading. unfolded: whether a reader sees the rows without a
/// click.
std::string score_table(const evaluation::Evaluation& evaluation);
/// rows: of all pairs. evaluated: some of the pairs, in the order of the pairs; empty without
/// ground truth.
std::string pair_table(const ResultFile& result, const std::vector<PairRow>& rows,
                       const std::vector<EvaluatedPair>& evaluated, bool unfolded);
std::string options_table(const Json& document, bool unfolded);

}  // namespace gpureg::cli
