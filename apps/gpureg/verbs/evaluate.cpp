// SPDX-License-Identifier: BSD-3-Clause
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "command.hpp"
#include "gpureg/error.hpp"
#include "json/json_file.hpp"
#include "options/output_path.hpp"
#include "pages/evaluate_table.hpp"
#include "pages/report_pairs.hpp"
#include "records/evaluation_json.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

using evaluation::Evaluation;
using evaluation::Scores;

struct EvaluateOptions {
  std::vector<std::string> results, truths, recall_logs;
  std::string json;
};

using Recalls = std::vector<std::pair<std::string, RegistrationRecall>>;  // of one scene, by log

void print(const std::string& scene, const Recalls& recalls) {
  for (const auto& [log, recall] : recalls)
    std::cout << "registration recall  " << percent(recall.recall()) << " % (" << recall.right
              << " of " << recall.pairs << " pairs, " << recall.tried
              << " tried; <= 15 deg, <= 0.30 m), " << scene << ", " << base_name(log) << "\n";
}

Json document(const EvaluateOptions& o, const std::vector<SceneEvaluation>& scenes,
              const std::vector<Recalls>& recalls) {
  Json json = {{"gpureg", "evaluate"}, {"version", GPUREG_VERSION}, {"scenes", Json::array()}};
  std::vector<Scores> strict, geometric;
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    const SceneEvaluation& s = scenes[k];
    Json scene = {{"scene", s.name}, {"result", o.results[k]}, {"ground_truth", o.truths[k]}};
    scene.update(to_json(s.evaluation));
    if (s.result.has_scores) add_curves(scene, s.truth, s.result);
    scene["pairs"] = pair_verdicts(s.truth, s.result);
    for (const auto& [log, recall] : recalls[k])
      scene["registration_recall"].push_back({{"log", log},
                                              {"right", recall.right},
                                              {"pairs", recall.pairs},
                                              {"tried", recall.tried},
                                              {"recall", recall.recall()}});
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
  if (!o.recall_logs.empty() && o.results.size() != 1)
    throw InvalidArgument("--registration-recall takes one result, not " +
                          std::to_string(o.results.size()));
  std::vector<NamedPath> inputs;
  for (const std::string& folder : o.truths) inputs.push_back({"--ground-truth", folder});
  for (const std::string& result : o.results) inputs.push_back({"RESULT", result});
  for (const std::string& log : o.recall_logs) inputs.push_back({"--registration-recall", log});
  check_outputs({{"--json", o.json}}, inputs);
  std::vector<SceneEvaluation> scenes;
  std::vector<Recalls> recalls;
  for (std::size_t k = 0; k < o.results.size(); ++k) {
    ResultFile result = read_result(o.results[k]);
    evaluation::GroundTruth truth = evaluation::read_ground_truth(o.truths[k]);
    check_belongs(result, o.truths[k], truth);
    Evaluation evaluation = evaluation::evaluate(truth, result.reports, result.has_scores);
    recalls.emplace_back();
    for (const std::string& log : o.recall_logs)
      recalls.back().emplace_back(log, registration_recall(log, result));
    scenes.push_back(
        {base_name(o.truths[k]), std::move(result), std::move(truth), std::move(evaluation)});
  }
  print_tables(scenes);
  for (std::size_t k = 0; k < scenes.size(); ++k) print(scenes[k].name, recalls[k]);
  if (!o.json.empty()) write_document(o.json, document(o, scenes, recalls));
  return kOk;
}

}  // namespace

void add_evaluate(CommandLine& line) {
  const auto o = std::make_shared<EvaluateOptions>();
  Verb verb = line.verb("evaluate", "Measure recall and precision by Redwood's protocol");
  verb.option("RESULT", o->results, "RESULT.log or RESULT.json; several make a scene mean")
      .required();
  verb.option("--ground-truth", o->truths,
              "Folder with gt.log and gt.info, perhaps gt_all.log and gt_all.info; one a result")
      .required();
  verb.option("--registration-recall", o->recall_logs,
              "Logs of true poses (3DMatch's gt.log): also the share of their pairs, "
              "consecutive ones too, whose "
              "best candidate is within 15 degrees and 0.30 m");
  verb.option("--json", o->json, "Write the numbers, curves and the verdict on every pair");
  verb.notes(
      "Numbers in %. Only pairs with j - i > 1 count. strict: a report that is not in gt.log\n"
      "counts as false; geometric: a report is correct if the pair is in gt_all.log and the "
      "pose\n"
      "within 0.2 m. raw: recall if every best candidate is reported; R@P: recall at that\n"
      "precision; AP: average precision. Rankings go by confidence; the strict one by\n"
      "overlap_confidence if RESULT.json has it.\n");
  verb.run([o] { return run(*o); });
}

}  // namespace gpureg::cli
