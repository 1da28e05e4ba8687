// SPDX-License-Identifier: BSD-3-Clause
#include "records/result_file.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "gpureg/error.hpp"
#include "inputs/scan_input.hpp"

namespace gpureg::cli {
namespace {

std::string name_of(int i, int j) {
  return "pair " + std::to_string(i) + " " + std::to_string(j) + " ";
}

// A program that lists fragments says which there are; no pair may name another. Names are empty
// where it has none.
std::map<int, std::string> fragments_of(const Json& document) {
  std::map<int, std::string> numbers;
  const auto fragments = document.find("fragments");
  if (fragments == document.end() || !fragments->is_array()) return numbers;
  for (const Json& fragment : *fragments)
    if (fragment.is_object() && fragment.contains("number") &&
        fragment["number"].is_number_integer())
      numbers[fragment["number"].get<int>()] =
          fragment.contains("name") && fragment["name"].is_string()
              ? fragment["name"].get<std::string>()
              : std::string();
  return numbers;
}

/// Place of each pair in its file, whatever the order of its fragments.
class Places {
 public:
  void add(const PairRecord& pair) {
    if (pair.i == pair.j)
      throw InvalidArgument(name_of(pair.i, pair.j) + "is a fragment and itself");
    const auto [first, is_new] = places_.insert({std::minmax({pair.i, pair.j}), places_.size()});
    if (!is_new)
      throw InvalidArgument(name_of(pair.i, pair.j) + "stands twice, first as pairs[" +
                            std::to_string(first->second) + "]");
  }

  void check_fragments(const std::string& path, const std::map<int, std::string>& numbers) const {
    if (numbers.empty()) return;
    for (const auto& [pair, place] : places_)
      for (const int number : {pair.first, pair.second})
        if (numbers.count(number) == 0)
          throw IoError(path + ": pairs[" + std::to_string(place) +
                        "]: " + name_of(pair.first, pair.second) + "names fragment " +
                        std::to_string(number) + ", which \"fragments\" lacks");
  }

 private:
  std::map<std::pair<int, int>, std::size_t> places_;
};

}  // namespace

Json read_pairs(DocumentFile& file,
                const std::function<void(const PairRecord& pair, Json&& json)>& each) {
  Places places;
  Json document = file.read("pairs", [&](Json&& json) {
    const PairRecord pair = record_from_json(json);
    places.add(pair);
    each(pair, std::move(json));
  });
  if (!document.is_object() || !document.contains("pairs") || !document["pairs"].is_array())
    throw IoError(file.path() + ": no result of `gpureg batch`, it has no array \"pairs\"");
  document.erase("pairs");
  places.check_fragments(file.path(), fragments_of(document));
  return document;
}

std::string ResultFile::label_of(int number) const {
  const auto found = names.find(number);
  return found == names.end() ? std::to_string(number) : label({number, "", found->second});
}

std::string ResultFile::title_of(int number) const {
  const auto found = names.find(number);
  return found == names.end() ? "fragment " + std::to_string(number)
                              : titled({number, "", found->second});
}

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

ResultFile read_result(const std::string& path, const std::function<void(const Json&)>& each) {
  ResultFile result;
  result.path = path;
  DocumentFile file(path);
  result.has_scores = file.begins_object();
  if (result.has_scores) {
    result.document = read_pairs(file, [&](const PairRecord& pair, Json&& json) {
      result.pairs.push_back(pair);
      if (each) each(json);
    });
    for (auto& [number, name] : fragments_of(result.document))
      if (!name.empty()) result.names[number] = name;
    for (const PairRecord& pair : result.pairs)
      if (pair.transform)
        result.reports.push_back({pair.i, pair.j, *pair.transform, pair.confidence, pair.aligned,
                                  pair.overlap_confidence});
  } else {
    result.log = evaluation::read_log(path);
    evaluation::check_entries(path, result.log);
    for (const evaluation::LogEntry& entry : result.log)
      result.reports.push_back({entry.i, entry.j, entry.transform});
  }
  return result;
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

}  // namespace gpureg::cli
