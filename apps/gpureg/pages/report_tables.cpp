// SPDX-License-Identifier: BSD-3-Clause
#include "pages/report_tables.hpp"

#include <algorithm>
#include <map>
#include <numeric>

#include "pages/plot.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

// Longer tables start folded: a scene of the benchmark has more than a thousand pairs.
constexpr std::size_t kMaxUnfoldedRows = 100;

// Empty for pairs that were not reported and are not listed in gt.log.
std::string outcome(const EvaluatedPair& pair) {
  if (pair.pair->aligned) return pair.correct ? "correct" : "false positive";
  return pair.in_truth ? "missed" : "";
}

std::string folded(const std::string& summary, bool open, const std::string& table) {
  return std::string("<details") + (open ? " open" : "") + "><summary>" + summary + "</summary>\n" +
         table + "</details>\n";
}

std::string count_of(const Json& pair, const char* name) {
  const std::string text = text_of(pair, (std::string("/statistics/") + name).c_str());
  return text.empty() || text.find_first_not_of("0123456789") != std::string::npos
             ? text
             : grouped(std::stoull(text.substr(0, 18)));
}

std::string measure(const Json& pair, const char* name, int digits) {
  const auto found = pair.find(name);
  return found != pair.end() && found->is_number() ? fixed(found->get<double>(), digits) : "";
}

}  // namespace

std::string text_of(const Json& json, const char* pointer) {
  const Json::json_pointer at(pointer);
  if (!json.contains(at)) return "";
  const Json& value = json.at(at);
  return value.is_string() ? value.get<std::string>() : value.dump();
}

std::optional<double> number_of(const Json& json, const char* pointer) {
  const Json::json_pointer at(pointer);
  if (!json.contains(at) || !json.at(at).is_number()) return std::nullopt;
  return json.at(at).get<double>();
}

std::string table_row(const std::vector<std::string>& texts, const char* tag,
                      const std::string& style) {
  std::string html = style.empty() ? "<tr>" : "<tr class=\"" + style + "\">";
  for (const std::string& text : texts)
    html += std::string("<") + tag + ">" + escaped(text) + "</" + tag + ">";
  return html + "</tr>\n";
}

PairRow pair_row(const Json& pair) {
  return {text_of(pair, "/status"),          measure(pair, "inlier_rmse", 4),
          count_of(pair, "correspondences"), count_of(pair, "survivors"),
          count_of(pair, "scored"),          count_of(pair, "inliers")};
}

std::string score_table(const evaluation::Evaluation& e) {
  std::string html = "<h2>Recall and precision</h2>\n<div class=\"wide\"><table>\n";
  html += table_row({"rule", "correct", "true pairs", "reported", "recall, %", "precision, %",
                     "raw recall, %", "R@P50, %", "R@P80, %", "R@P95, %", "R@P99, %", "AP, %"},
                    "th");
  const auto row = [&](const char* rule, const evaluation::Scores& s,
                       const std::optional<evaluation::RankedScores>& r) {
    std::vector<std::string> texts = {rule,
                                      std::to_string(s.good),
                                      std::to_string(s.ground_truth),
                                      std::to_string(s.reported),
                                      percent(s.recall()),
                                      percent(s.precision())};
    if (r)
      for (const double value : {r->raw_recall, r->recall_at_50, r->recall_at_80, r->recall_at_95,
                                 r->recall_at_99, r->average_precision})
        texts.push_back(percent(value));
    html += table_row(texts, "td");
  };
  row("strict", e.strict, e.strict_ranked);
  if (e.geometric) row("geometric", *e.geometric, e.geometric_ranked);
  return html +
         "</table></div>\n<p class=\"sub\">Redwood's protocol, pairs with j &minus; i &gt; 1. A "
         "pose is correct "
         "within 0.2 m of the ground truth. The strict rule counts a pair that overlaps by less "
         "than "
         "30 % as false; the geometric rule counts it by its pose. Raw recall: recall when every "
         "best candidate is reported. R@P80: recall at 80 % precision. AP: average "
         "precision.</p>\n";
}

std::string pair_table(const ResultFile& result, const std::vector<PairRow>& rows,
                       const std::vector<EvaluatedPair>& evaluated, bool unfolded) {
  std::map<const PairRecord*, std::string> outcomes;
  for (const EvaluatedPair& e : evaluated) outcomes[e.pair] = outcome(e);
  std::vector<std::string> titles = {"target i", "source j",  "status", "reason",  "score", "rmse",
                                     "matches",  "survivors", "scored", "inliers", "ms"};
  if (!evaluated.empty()) titles.push_back("evaluation");
  std::string html = "<table>\n" + table_row(titles, "th");
  std::vector<std::size_t> order(result.pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return result.pairs[a].score > result.pairs[b].score;
  });
  for (const std::size_t k : order) {
    const PairRecord& pair = result.pairs[k];
    const PairRow& row = rows[k];
    std::vector<std::string> texts = {result.label_of(pair.i),
                                      result.label_of(pair.j),
                                      row.status,
                                      pair.aligned ? "" : pair.reason,
                                      fixed(pair.score, 3),
                                      row.inlier_rmse,
                                      row.correspondences,
                                      row.survivors,
                                      row.scored,
                                      row.inliers,
                                      fixed(pair.milliseconds, 1)};
    const auto found = outcomes.find(&pair);
    const std::string text = found == outcomes.end() ? "" : found->second;
    if (!evaluated.empty()) texts.push_back(text);
    html += table_row(texts, "td", text);
  }
  html += "</table>\n";
  if (!evaluated.empty())
    html +=
        "<p class=\"sub\">Correct: the reported pose is within 0.2 m of the ground truth. False "
        "positive: the reported pose is farther away, or the pair does not overlap. Missed: the "
        "pair overlaps by 30 % or more and was not reported. Neighbours (j &minus; i = 1) are not "
        "evaluated.</p>\n";
  return "<h2>Every pair</h2>\n" + folded(std::to_string(result.pairs.size()) + " pairs",
                                          unfolded && result.pairs.size() <= kMaxUnfoldedRows,
                                          html);
}

std::string options_table(const Json& document, bool unfolded) {
  const auto options = document.find("options");
  if (options == document.end() || !options->is_object()) return "";
  std::string general, stages;
  for (const auto& stage : options->items())
    if (stage.value().is_object())
      for (const auto& option : stage.value().items())
        stages += table_row({stage.key(), option.key(), text_of(option.value(), "")}, "td");
    else
      general += table_row({"general", stage.key(), text_of(stage.value(), "")}, "td");
  return "<h2>Options</h2>\n" +
         folded("Every option of this run", unfolded,
                "<table class=\"options\">\n" + table_row({"stage", "option", "value"}, "th") +
                    general + stages +
                    "</table>\n<p class=\"sub\">Lengths in the unit of the clouds, angles in "
                    "degrees.</p>\n");
}

}  // namespace gpureg::cli
