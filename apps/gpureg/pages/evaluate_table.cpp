// SPDX-License-Identifier: BSD-3-Clause
#include "pages/evaluate_table.hpp"

#include <algorithm>
#include <iostream>
#include <optional>
#include <set>
#include <utility>

#include "text.hpp"

namespace gpureg::cli {
namespace {

using evaluation::Evaluation;
using evaluation::RankedScores;
using evaluation::Scores;

constexpr std::size_t kNumber = 9;  // width of a column

std::string cell(const std::string& text) { return pad_left(text, kNumber); }

std::string row(const Scores& s, const std::optional<RankedScores>& ranked) {
  // Of no reports all are right, in the protocol's means; a reader would take it for a success.
  const std::string precision = s.reported > 0 ? percent(s.precision()) : "n/a";
  std::string text = cell(std::to_string(s.good)) + cell(std::to_string(s.ground_truth)) +
                     cell(std::to_string(s.reported)) + cell(percent(s.recall())) +
                     pad_left(precision, kNumber + 2);
  if (ranked)
    for (const double value :
         {ranked->raw_recall, ranked->recall_at_50, ranked->recall_at_80, ranked->recall_at_95,
          ranked->recall_at_99, ranked->average_precision})
      text += cell(percent(value));
  return text;
}

// One rule's table; `get` picks the rule's scores of a scene, or none.
template <class Get>
void print_table(const char* rule, const std::vector<SceneEvaluation>& scenes, std::size_t width,
                 const Get& get) {
  std::vector<Scores> all;
  bool ranked = false;
  for (const SceneEvaluation& scene : scenes)
    if (get(scene.evaluation).first) ranked |= get(scene.evaluation).second.has_value();
  std::string head = pad_right(rule, width) + cell("good") + cell("truth") + cell("reported") +
                     cell("recall") + pad_left("precision", kNumber + 2);
  if (ranked)
    head +=
        cell("raw") + cell("R@P50") + cell("R@P80") + cell("R@P95") + cell("R@P99") + cell("AP");
  std::cout << head << "\n";
  for (const SceneEvaluation& scene : scenes) {
    const auto& [scores, rank] = get(scene.evaluation);
    if (!scores) continue;
    all.push_back(*scores);
    std::cout << pad_right(scene.name, width) << row(*scores, rank) << "\n";
  }
  if (all.size() > 1) {
    const evaluation::MeanScores mean = evaluation::scene_mean(all);
    std::cout << pad_right("mean of " + std::to_string(all.size()) + " scenes", width)
              << std::string(3 * kNumber, ' ') << cell(percent(mean.recall))
              << pad_left(percent(mean.precision), kNumber + 2) << "\n";
  }
}

// Notes on the numbers that are not counted.
void print_notes(const SceneEvaluation& scene) {
  const ResultFile& result = scene.result;
  const auto note = [&](long long number, const char* what) {
    if (number > 0) std::cout << "note: " << scene.name << ": " << number << " " << what << "\n";
  };
  if (std::none_of(result.reports.begin(), result.reports.end(),
                   [](const evaluation::Report& report) { return report.reported; }))
    std::cout << "note: " << scene.name << ": " << result.path << " holds no reports\n";
  std::set<std::pair<int, int>> tried;
  long long neighbors = 0, missing = 0;
  for (const evaluation::Report& report : result.reports) neighbors += report.j - report.i <= 1;
  for (const PairRecord& pair : result.pairs) tried.insert({pair.i, pair.j});
  for (const evaluation::LogEntry& entry : scene.truth.log)
    missing += entry.j - entry.i > 1 && tried.count({entry.i, entry.j}) == 0;
  note(neighbors, "poses of pairs with j - i <= 1 do not count");
  if (result.has_scores) note(missing, "pairs of the truth were not tried, they count as missed");
  if (result.document.is_object() && result.document.contains("complete") &&
      result.document["complete"] == false)
    std::cout << "note: " << scene.name << ": the batch was not finished\n";
}

}  // namespace

void print_tables(const std::vector<SceneEvaluation>& scenes) {
  std::size_t width = 20;
  for (const SceneEvaluation& scene : scenes) width = std::max(width, scene.name.size() + 1);
  using Row = std::pair<std::optional<Scores>, std::optional<RankedScores>>;
  print_table("strict", scenes, width,
              [](const Evaluation& e) { return Row(e.strict, e.strict_ranked); });
  if (std::any_of(scenes.begin(), scenes.end(),
                  [](const SceneEvaluation& s) { return s.evaluation.geometric.has_value(); }))
    print_table("geometric", scenes, width,
                [](const Evaluation& e) { return Row(e.geometric, e.geometric_ranked); });
  bool titled = false;
  for (const SceneEvaluation& scene : scenes) {
    if (scene.result.pairs.empty()) continue;
    if (!titled)
      std::cout << pad_right("time", width) << "ms per pair, ms per fragment (preparation)\n";
    titled = true;
    std::cout << pad_right(scene.name, width) << cell(fixed(scene.result.mean_milliseconds(), 1))
              << cell(fixed(scene.result.mean_prepare_milliseconds(), 1)) << "\n";
  }
  for (const SceneEvaluation& scene : scenes) print_notes(scene);
}

}  // namespace gpureg::cli
