// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "json_file.hpp"
#include "output_path.hpp"
#include "result_file.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

using evaluation::Evaluation;
using evaluation::RankedScores;
using evaluation::Scores;

struct EvaluateOptions {
  std::vector<std::string> results, truths;
  std::string json;
};

struct SceneEvaluation {
  std::string name;
  ResultFile result;
  Evaluation evaluation;
};

constexpr std::size_t kNumber = 9;  // width of a column

std::string cell(const std::string& text) { return pad_left(text, kNumber); }

std::string row(const Scores& s, const std::optional<RankedScores>& ranked) {
  std::string text = cell(std::to_string(s.good)) + cell(std::to_string(s.ground_truth)) +
                     cell(std::to_string(s.reported)) + cell(percent(s.recall())) +
                     pad_left(percent(s.precision()), kNumber + 2);
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

void print(const std::vector<SceneEvaluation>& scenes) {
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
}

Json document(const EvaluateOptions& o, const std::vector<SceneEvaluation>& scenes) {
  Json json = {{"gpureg", "evaluate"}, {"version", GPUREG_VERSION}, {"scenes", Json::array()}};
  std::vector<Scores> strict, geometric;
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    const SceneEvaluation& s = scenes[k];
    Json scene = {{"scene", s.name}, {"result", o.results[k]}, {"ground_truth", o.truths[k]}};
    scene.update(to_json(s.evaluation));
    if (!s.result.pairs.empty())
      scene["ms"] = {{"pair", s.result.mean_milliseconds()},
                     {"fragment", s.result.mean_prepare_milliseconds()}};
    json["scenes"].push_back(std::move(scene));
    strict.push_back(s.evaluation.strict);
    if (s.evaluation.geometric) geometric.push_back(*s.evaluation.geometric);
  }
  const auto mean = [](const std::vector<Scores>& scores) -> Json {
    const evaluation::MeanScores m = evaluation::scene_mean(scores);
    return {{"scenes", scores.size()}, {"recall", m.recall}, {"precision", m.precision}};
  };
  json["mean"]["strict"] = mean(strict);
  if (!geometric.empty()) json["mean"]["geometric"] = mean(geometric);
  return json;
}

int run(const EvaluateOptions& o) {
  if (o.results.size() != o.truths.size())
    throw InvalidArgument("--ground-truth names " + std::to_string(o.truths.size()) +
                          " folders for " + std::to_string(o.results.size()) +
                          " results; give one for each, in the same order");
  check_output(o.json);
  std::vector<SceneEvaluation> scenes;
  for (std::size_t k = 0; k < o.results.size(); ++k) {
    ResultFile result = read_result(o.results[k]);
    const evaluation::GroundTruth truth = evaluation::read_ground_truth(o.truths[k]);
    Evaluation evaluation = evaluation::evaluate(truth, result.reports, result.has_scores);
    scenes.push_back({base_name(o.truths[k]), std::move(result), std::move(evaluation)});
  }
  print(scenes);
  if (!o.json.empty()) write_document(o.json, document(o, scenes));
  return kOk;
}

}  // namespace

void add_evaluate(CLI::App& app, Action& chosen) {
  const auto o = std::make_shared<EvaluateOptions>();
  CLI::App* verb = app.add_subcommand("evaluate", "Compare results with the truth, Redwood's way");
  verb->add_option("RESULT", o->results, "RESULT.log or RESULT.json; several make a scene mean")
      ->required();
  verb->add_option(
          "--ground-truth", o->truths,
          "Folder with gt.log and gt.info, perhaps gt_all.log and gt_all.info; one a result")
      ->required();
  verb->add_option("--json", o->json, "Write the numbers");
  verb->footer(
      std::string(
          "Numbers in %. Only pairs with j - i > 1 count. strict: a report that is not in gt.log "
          "is "
          "wrong;\n"
          "geometric: right where the pair is in gt_all.log and within 0.2 m. raw: recall when "
          "every "
          "best\n"
          "candidate is reported; R@P: recall at that precision; AP: average precision.\n") +
      app.get_footer());
  verb->callback([o, &chosen] { chosen = [o] { return run(*o); }; });
}

}  // namespace gpureg::cli
