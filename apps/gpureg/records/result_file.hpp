// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "gpureg/evaluation.hpp"
#include "json/json.hpp"
#include "json/json_file.hpp"
#include "records/pair_json.hpp"

namespace gpureg::cli {

/// The reader of RESULT.json: of `gpureg batch` and `consistency`, pairs.json of a map, or of
/// another program that writes such pairs.
/// @param each receives the pairs in order; what it throws as InvalidArgument names the pair.
/// @return the document without its pairs.
/// @throws IoError naming file and pair: no such document, a damaged pair, a pair that stands twice
///   or is of one fragment, or whose fragments "fragments" lacks.
Json read_pairs(DocumentFile& file,
                const std::function<void(const PairRecord& pair, Json&& json)>& each);

/// What `evaluate` and `report` read: RESULT.log or RESULT.json.
struct ResultFile {
  std::string path;
  bool has_scores = false;        ///< it was JSON: confidences and unreported candidates are known
  std::vector<PairRecord> pairs;  ///< JSON only
  std::vector<evaluation::Report> reports;
  std::vector<evaluation::LogEntry> log;  ///< logs only
  Json document;                          ///< JSON only, without its pairs

  std::map<int, std::string> names;  ///< of scans by number, as far as the document has them

  std::string label_of(int number) const;  ///< what people call a scan
  std::string title_of(int number) const;  ///< "fragment 12", or the name

  double mean_milliseconds() const;          ///< per pair; 0 without pairs
  double mean_prepare_milliseconds() const;  ///< per fragment; 0 where not known
};

/// Recognises the format by content.
/// @param each sees the JSON of each pair; may be empty.
/// @throws IoError naming the file and the reason.
ResultFile read_result(const std::string& path, const std::function<void(const Json&)>& each = {});

/// Throws IoError naming file and place where a result cannot be one of the scene that the truth is
/// of.
void check_belongs(const ResultFile& result, const std::string& truth_folder,
                   const evaluation::GroundTruth& truth);

}  // namespace gpureg::cli
