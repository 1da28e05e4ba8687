// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "records/result_file.hpp"

namespace gpureg::cli {

struct Picture {
  std::string heading, caption;
  std::string png;
};

/// A result with everything that the page shows of it.
struct ReportEntry {
  std::string name;  ///< tells the results of one page apart
  ResultFile result;
  Json pairs = Json::array();  ///< pair_row() of its pairs
  std::string scene;           ///< name of the ground truth's folder, else of the fragments' folder
  std::optional<evaluation::GroundTruth> truth;
  std::optional<evaluation::Evaluation> evaluation;  ///< with truth
  std::vector<Picture> pictures;
};

/// What the page shows of the JSON of a pair, whatever program wrote it.
Json pair_row(const Json& pair);

/// One self-contained HTML page: numbers, plots and pictures of each result. Several results come
/// after a comparison. entries: at least one.
std::string report_page(std::vector<ReportEntry> entries);

}  // namespace gpureg::cli
