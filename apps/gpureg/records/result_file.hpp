// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gpureg/evaluation.hpp"
#include "records/json.hpp"
#include "records/pair_record.hpp"

namespace gpureg::cli {

/// What `evaluate` and `report` read: RESULT.log, or RESULT.json of a batch.
struct ResultFile {
  std::string path;
  bool has_scores = false;        ///< it was JSON: scores and unreported candidates are known
  std::vector<PairRecord> pairs;  ///< JSON only
  std::vector<evaluation::Report> reports;
  std::vector<evaluation::LogEntry> log;  ///< logs only
  Json document;                          ///< JSON only, without its pairs

  double mean_milliseconds() const;          ///< per pair; 0 without pairs
  double mean_prepare_milliseconds() const;  ///< per fragment; 0 where not known
};

/// Recognises the format by content. Throws IoError naming the file and the reason.
ResultFile read_result(const std::string& path);

/// Throws IoError naming file and place where a result cannot be one of the scene that the truth is
/// of.
void check_belongs(const ResultFile& result, const std::string& truth_folder,
                   const evaluation::GroundTruth& truth);

/// JSON of scores, as `evaluate --json` writes it.
Json to_json(const evaluation::Evaluation& evaluation);

}  // namespace gpureg::cli
