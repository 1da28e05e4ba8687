// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pages/report_tables.hpp"
#include "pages/stage_times.hpp"
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
  std::vector<PairRow> rows;  ///< of its pairs
  StageTimes stages;          ///< of its pairs
  std::string scene;          ///< name of the ground truth's folder, else of the fragments' folder
  std::optional<evaluation::GroundTruth> truth;
  std::optional<evaluation::Evaluation> evaluation;  ///< with truth
  std::vector<Picture> pictures;
};

/// One self-contained HTML page: numbers, plots and pictures of each result. Several results come
/// after a comparison. entries: at least one.
std::string report_page(const std::vector<ReportEntry>& entries);

}  // namespace gpureg::cli
