// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "records/result_file.hpp"

namespace gpureg::cli {

/// One scene of `evaluate`.
struct SceneEvaluation {
  std::string name;
  ResultFile result;
  evaluation::GroundTruth truth;
  evaluation::Evaluation evaluation;
};

/// Prints the tables of recall, precision and time, and notes on uncounted pairs, to standard
/// output.
void print_tables(const std::vector<SceneEvaluation>& scenes);

}  // namespace gpureg::cli
