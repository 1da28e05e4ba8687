// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "report_pairs.hpp"
#include "result_file.hpp"

namespace gpureg::cli {

/// The value at a JSON pointer as a person writes it; empty where there is none.
std::string text_of(const Json& json, const char* pointer);

/// Parts of the page, each with its heading.
std::string score_table(const evaluation::Evaluation& evaluation);
/// judged: the verdicts on some of the pairs, in the order of the pairs; none without a truth.
std::string pair_table(const ResultFile& result, const std::vector<EvaluatedPair>& judged);
std::string options_table(const Json& document);

}  // namespace gpureg::cli
