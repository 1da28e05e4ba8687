// SPDX-License-Identifier: BSD-3-Clause
#include "records/result_file.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "gpureg/error.hpp"
#include "records/json_file.hpp"

namespace gpureg::cli {
namespace {

// The library's number of the error, which its messages begin with, means nothing to a user.
std::string plain(const std::string& message) {
  const std::size_t end = message.find("] ");
  return message.rfind("[json.", 0) == 0 && end != std::string::npos ? message.substr(end + 2)
                                                                     : message;
}

// A program that lists fragments says which there are; no pair may name another.
std::set<int> fragment_numbers(const Json& document) {
  std::set<int> numbers;
  const auto fragments = document.find("fragments");
  if (fragments == document.end() || !fragments->is_array()) return numbers;
  for (const Json& fragment : *fragments)
    if (fragment.is_object() && fragment.contains("number") &&
        fragment["number"].is_number_integer())
      numbers.insert(fragment["number"].get<int>());
  return numbers;
}

void check_pairs(const ResultFile& file, const Json& document) {
  const std::set<int> numbers = fragment_numbers(document);
  std::map<std::pair<int, int>, std::size_t> places;
  for (std::size_t k = 0; k < file.pairs.size(); ++k) {
    const PairRecord& pair = file.pairs[k];
    const auto fail = [&](const std::string& reason) {
      throw IoError(file.path + ": pairs[" + std::to_string(k) + "]: pair " +
                    std::to_string(pair.i) + " " + std::to_string(pair.j) + " " + reason);
    };
    if (pair.i == pair.j) fail("is a fragment and itself");
    if (!numbers.empty())
      for (const int number : {pair.i, pair.j})
        if (numbers.count(number) == 0)
          fail("names fragment " + std::to_string(number) + ", which \"fragments\" lacks");
    const auto [first, is_new] = places.insert({{pair.i, pair.j}, k});
    if (!is_new) fail("stands twice, first as pairs[" + std::to_string(first->second) + "]");
  }
}

void read_pairs(ResultFile& file, Json document) {
  if (!document.is_object() || !document.contains("pairs") || !document["pairs"].is_array())
    throw IoError(file.path + ": no result of `gpureg batch`, it has no array \"pairs\"");
  Json& pairs = document["pairs"];
  for (std::size_t k = 0; k < pairs.size(); ++k) try {
      file.pairs.push_back(PairRecord::from_json(pairs[k]));
    } catch (const InvalidArgument& error) {
      throw IoError(file.path + ": pairs[" + std::to_string(k) + "]: " + error.what());
    }
  check_pairs(file, document);
  document.erase("pairs");
  file.document = std::move(document);
  for (const PairRecord& pair : file.pairs)
    if (pair.transform)
      file.reports.push_back(
          {pair.i, pair.j, *pair.transform, pair.score, pair.aligned, pair.strict_score});
}

Json to_json(const evaluation::Scores& s) {
  return {
      {"good", s.good},         {"good_recall", s.good_recall}, {"ground_truth", s.ground_truth},
      {"reported", s.reported}, {"recall", s.recall()},         {"precision", s.precision()}};
}

Json to_json(const evaluation::RankedScores& r) {
  return {{"raw_recall", r.raw_recall},
          {"recall_at_precision",
           {{"50", r.recall_at_50},
            {"80", r.recall_at_80},
            {"95", r.recall_at_95},
            {"99", r.recall_at_99}}},
          {"average_precision", r.average_precision}};
}

}  // namespace

double ResultFile::mean_milliseconds() const {
  double sum = 0;
  for (const PairRecord& pair : pairs) sum += pair.milliseconds;
  return pairs.empty() ? 0 : sum / static_cast<double>(pairs.size());
}

double ResultFile::mean_prepare_milliseconds() const try {
  const Json& fragments = document.at("fragments");
  double sum = 0;
  for (const Json& fragment : fragments) sum += fragment.at("ms").at("total").get<double>();
  return fragments.empty() ? 0 : sum / static_cast<double>(fragments.size());
} catch (const Json::exception&) {
  return 0;  // not every program that writes pairs tells it
}

ResultFile read_result(const std::string& path) {
  ResultFile file;
  file.path = path;
  const std::string text = read_text(path);
  const std::size_t start = text.find_first_not_of(" \t\r\n");
  file.has_scores = start != std::string::npos && text[start] == '{';
  if (file.has_scores) {
    Json document;
    try {
      document = Json::parse(text);
    } catch (const Json::exception& error) {
      throw IoError(path + ": " + plain(error.what()));
    }
    check_format(path, document);
    read_pairs(file, std::move(document));
  } else {
    file.log = evaluation::read_log(path);
    evaluation::check_entries(path, file.log);
    for (const evaluation::LogEntry& entry : file.log)
      file.reports.push_back({entry.i, entry.j, entry.transform});
  }
  return file;
}

void check_belongs(const ResultFile& result, const std::string& truth_folder,
                   const evaluation::GroundTruth& truth) {
  if (truth.log.empty()) return;
  const int count = truth.log.front().count;
  const std::string says = truth_folder + "/gt.log says that there are " + std::to_string(count);
  if (!result.log.empty() && result.log.front().count != count)
    throw IoError(result.path + ":" + std::to_string(result.log.front().line) + ": " +
                  std::to_string(result.log.front().count) + " fragments, but " + says);
  for (std::size_t k = 0; k < result.pairs.size(); ++k)
    if (const PairRecord& pair = result.pairs[k]; std::max(pair.i, pair.j) >= count)
      throw IoError(result.path + ": pairs[" + std::to_string(k) + "]: pair " +
                    std::to_string(pair.i) + " " + std::to_string(pair.j) + " is out of range, " +
                    says + " fragments, from 0");
}

Json to_json(const evaluation::Evaluation& e) {
  Json json;
  json["strict"] = to_json(e.strict);
  if (e.strict_ranked) json["strict"].update(to_json(*e.strict_ranked));
  if (e.geometric) {
    json["geometric"] = to_json(*e.geometric);
    if (e.geometric_ranked) json["geometric"].update(to_json(*e.geometric_ranked));
  }
  return json;
}

}  // namespace gpureg::cli
