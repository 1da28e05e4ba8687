// SPDX-License-Identifier: BSD-3-Clause
#include "report_pairs.hpp"

#include <algorithm>
#include <functional>
#include <map>

#include "text.hpp"

namespace gpureg::cli {
namespace {

using evaluation::GroundTruth;

constexpr double kGoodDistance = 0.2;     // metres, Redwood's rule
constexpr std::size_t kThresholds = 200;  // a curve needs no more corners

bool farther(const PairRecord* a, const PairRecord* b) { return a->score > b->score; }

std::string numbers(const PairRecord& pair) {
  return "fragment " + std::to_string(pair.j) + " onto " + std::to_string(pair.i) + ", score " +
         fixed(pair.score, 2);
}

void take(std::vector<SamplePair>& samples, const std::vector<const PairRecord*>& pairs,
          std::size_t each, const std::string& heading,
          const std::function<std::string(const PairRecord&)>& remark) {
  for (std::size_t k = 0; k < std::min(each, pairs.size()); ++k)
    samples.push_back({pairs[k], heading, numbers(*pairs[k]) + remark(*pairs[k])});
}

// The middle first, then the one that nearly failed: pairs come sorted, the best first.
std::vector<const PairRecord*> typical_and_narrow(const std::vector<const PairRecord*>& pairs) {
  if (pairs.size() < 2) return pairs;
  return {pairs[(pairs.size() - 1) / 2], pairs.back()};
}

std::string no_remark(const PairRecord&) { return ""; }

}  // namespace

std::vector<EvaluatedPair> judge(const GroundTruth& truth, const ResultFile& result) {
  using Key = std::pair<int, int>;
  std::map<Key, bool> in_truth;
  for (const evaluation::LogEntry& entry : truth.log) in_truth[{entry.i, entry.j}] = true;
  const bool wide = !truth.all_log.empty();
  const auto& log = wide ? truth.all_log : truth.log;
  const auto& information = wide ? truth.all_information : truth.information;
  std::map<Key, std::size_t> at;
  for (std::size_t k = 0; k < log.size(); ++k) at[{log[k].i, log[k].j}] = k;

  std::vector<EvaluatedPair> judged;
  for (const PairRecord& pair : result.pairs) {
    if (pair.j - pair.i <= 1) continue;
    const Key key(pair.i, pair.j);
    EvaluatedPair verdict{&pair, in_truth.count(key) > 0, false};
    const auto found = at.find(key);
    if (found != at.end() && pair.transform)
      verdict.right =
          evaluation::redwood_error(log[found->second].transform, *pair.transform,
                                    information[found->second].information) <= kGoodDistance;
    judged.push_back(verdict);
  }
  return judged;
}

std::vector<std::pair<double, double>> recall_precision(const GroundTruth& truth,
                                                        const ResultFile& result, bool geometric) {
  std::vector<evaluation::Report> reports = result.reports;
  if (!geometric)
    for (evaluation::Report& report : reports) {
      report.score = report.strict_score.value_or(report.score);
      report.strict_score.reset();
    }
  std::vector<double> thresholds;
  for (const evaluation::Report& report : reports) thresholds.push_back(report.score);
  std::sort(thresholds.begin(), thresholds.end(), std::greater<>());
  thresholds.erase(std::unique(thresholds.begin(), thresholds.end()), thresholds.end());
  std::vector<std::pair<double, double>> curve;
  const std::size_t steps = std::min(kThresholds, thresholds.size());
  for (std::size_t s = 0; s < steps; ++s) {
    const std::size_t k = steps > 1 ? s * (thresholds.size() - 1) / (steps - 1) : 0;
    for (evaluation::Report& report : reports) report.reported = report.score >= thresholds[k];
    const evaluation::Evaluation e = evaluation::evaluate(truth, reports, false);
    const evaluation::Scores& scores = geometric ? *e.geometric : e.strict;
    curve.emplace_back(scores.recall(), scores.precision());
  }
  return curve;
}

std::vector<SamplePair> samples(const std::vector<EvaluatedPair>& judged, std::size_t each) {
  std::vector<const PairRecord*> right, wrong, missed;
  std::map<const PairRecord*, bool> candidate_right;
  for (const EvaluatedPair& j : judged) {
    if (j.pair->aligned)
      (j.right ? right : wrong).push_back(j.pair);
    else if (j.in_truth)
      missed.push_back(j.pair);
    candidate_right[j.pair] = j.right;
  }
  for (auto* pairs : {&right, &wrong, &missed}) std::sort(pairs->begin(), pairs->end(), farther);
  std::vector<SamplePair> chosen;
  take(chosen, typical_and_narrow(right), each, "Right", no_remark);
  take(chosen, wrong, each, "Wrong", no_remark);
  take(chosen, missed, each, "Missed", [&](const PairRecord& pair) {
    if (!pair.transform) return ": " + pair.reason;
    return ": " + pair.reason + "; the best candidate was " +
           (candidate_right[&pair] ? "right" : "wrong");
  });
  return chosen;
}

std::vector<SamplePair> samples(const ResultFile& result, std::size_t each) {
  std::vector<const PairRecord*> aligned, rejected;
  for (const PairRecord& pair : result.pairs) (pair.aligned ? aligned : rejected).push_back(&pair);
  for (auto* pairs : {&aligned, &rejected}) std::sort(pairs->begin(), pairs->end(), farther);
  std::vector<SamplePair> chosen;
  take(chosen, typical_and_narrow(aligned), each, "Aligned", no_remark);
  take(chosen, rejected, each, "Not aligned",
       [](const PairRecord& pair) { return ": " + pair.reason; });
  return chosen;
}

}  // namespace gpureg::cli
