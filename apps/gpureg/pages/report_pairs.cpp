// SPDX-License-Identifier: BSD-3-Clause
#include "pages/report_pairs.hpp"

#include <algorithm>
#include <functional>
#include <map>

#include "text.hpp"

namespace gpureg::cli {
namespace {

using evaluation::GroundTruth;

constexpr double kCorrectDistance = 0.2;  // metres, Redwood's rule
constexpr std::size_t kThresholds = 200;  // more points than a plot of 460 pixels can show

bool more_confident(const PairRecord* a, const PairRecord* b) {
  return a->confidence > b->confidence;
}

std::string names(const ResultFile& result, const PairRecord& pair) {
  return result.title_of(pair.j) + " onto " + result.label_of(pair.i) + ", confidence " +
         fixed(pair.confidence, 2);
}

void take(std::vector<SamplePair>& samples, const ResultFile& result,
          const std::vector<const PairRecord*>& pairs, std::size_t each, const std::string& heading,
          const std::function<std::string(const PairRecord&)>& remark) {
  for (std::size_t k = 0; k < std::min(each, pairs.size()); ++k)
    samples.push_back({pairs[k], heading, names(result, *pairs[k]) + remark(*pairs[k])});
}

// The median confidence first, then the lowest one. pairs: sorted by falling confidence.
std::vector<const PairRecord*> median_and_lowest(const std::vector<const PairRecord*>& pairs) {
  if (pairs.size() < 2) return pairs;
  return {pairs[(pairs.size() - 1) / 2], pairs.back()};
}

std::string reason(const PairRecord& pair) {
  return ": " + pair.reason + (pair.explanation.empty() ? "" : ", " + pair.explanation);
}

std::string no_remark(const PairRecord&) { return ""; }

// (recall, precision) for a falling least confidence. geometric: by the geometric rule, which needs
// gt_all.log.
std::vector<std::pair<double, double>> recall_precision(const GroundTruth& truth,
                                                        const ResultFile& result, bool geometric) {
  std::vector<evaluation::Report> reports = result.reports;
  if (!geometric)
    for (evaluation::Report& report : reports) {
      report.confidence = report.overlap_confidence.value_or(report.confidence);
      report.overlap_confidence.reset();
    }
  std::vector<double> thresholds;
  for (const evaluation::Report& report : reports) thresholds.push_back(report.confidence);
  std::sort(thresholds.begin(), thresholds.end(), std::greater<>());
  thresholds.erase(std::unique(thresholds.begin(), thresholds.end()), thresholds.end());
  std::vector<std::pair<double, double>> curve;
  const std::size_t steps = std::min(kThresholds, thresholds.size());
  for (std::size_t s = 0; s < steps; ++s) {
    const std::size_t k = steps > 1 ? s * (thresholds.size() - 1) / (steps - 1) : 0;
    for (evaluation::Report& report : reports) report.reported = report.confidence >= thresholds[k];
    const evaluation::Evaluation e = evaluation::evaluate(truth, reports, false);
    const evaluation::Scores& scores = geometric ? *e.geometric : e.strict;
    curve.emplace_back(scores.recall(), scores.precision());
  }
  return curve;
}

}  // namespace

std::vector<EvaluatedPair> evaluate_pairs(const GroundTruth& truth, const ResultFile& result) {
  using Key = std::pair<int, int>;
  std::map<Key, bool> in_truth;
  for (const evaluation::LogEntry& entry : truth.log) in_truth[{entry.i, entry.j}] = true;
  const bool any_overlap = !truth.all_log.empty();
  const auto& log = any_overlap ? truth.all_log : truth.log;
  const auto& information = any_overlap ? truth.all_information : truth.information;
  std::map<Key, std::size_t> at;
  for (std::size_t k = 0; k < log.size(); ++k) at[{log[k].i, log[k].j}] = k;

  std::vector<EvaluatedPair> evaluated;
  for (const PairRecord& pair : result.pairs) {
    if (pair.j - pair.i <= 1) continue;
    const Key key(pair.i, pair.j);
    EvaluatedPair entry{&pair, in_truth.count(key) > 0, false};
    const auto found = at.find(key);
    if (found != at.end() && pair.transform)
      entry.correct =
          evaluation::redwood_error(log[found->second].transform, *pair.transform,
                                    information[found->second].information) <= kCorrectDistance;
    evaluated.push_back(entry);
  }
  return evaluated;
}

void add_curves(Json& evaluation, const GroundTruth& truth, const ResultFile& result) {
  for (const char* rule : {"strict", "geometric"})
    if (evaluation.contains(rule))
      evaluation[rule]["curve"] = recall_precision(truth, result, rule == std::string("geometric"));
}

std::vector<SamplePair> samples(const ResultFile& result,
                                const std::vector<EvaluatedPair>& evaluated, std::size_t each) {
  std::vector<const PairRecord*> correct, false_positive, missed;
  std::map<const PairRecord*, bool> candidate_correct;
  for (const EvaluatedPair& e : evaluated) {
    if (e.pair->aligned)
      (e.correct ? correct : false_positive).push_back(e.pair);
    else if (e.in_truth)
      missed.push_back(e.pair);
    candidate_correct[e.pair] = e.correct;
  }
  for (auto* pairs : {&correct, &false_positive, &missed})
    std::sort(pairs->begin(), pairs->end(), more_confident);
  std::vector<SamplePair> chosen;
  take(chosen, result, median_and_lowest(correct), each, "Correct", no_remark);
  take(chosen, result, false_positive, each, "False positive", no_remark);
  take(chosen, result, missed, each, "Missed", [&](const PairRecord& pair) {
    if (!pair.transform) return reason(pair);
    return reason(pair) + "; the best candidate is " +
           (candidate_correct[&pair] ? "correct" : "false");
  });
  return chosen;
}

std::vector<SamplePair> samples(const ResultFile& result, std::size_t most) {
  std::vector<const PairRecord*> pairs;
  for (const PairRecord& pair : result.pairs) pairs.push_back(&pair);
  std::stable_sort(pairs.begin(), pairs.end(), more_confident);
  std::vector<SamplePair> chosen;
  const std::size_t count = std::min(most, pairs.size());
  for (std::size_t k = 0; k < count; ++k) {
    const PairRecord& pair = *pairs[count < 2 ? 0 : k * (pairs.size() - 1) / (count - 1)];
    chosen.push_back({&pair, pair.aligned ? "Aligned" : "Not aligned",
                      names(result, pair) + (pair.aligned ? "" : reason(pair))});
  }
  return chosen;
}

}  // namespace gpureg::cli
