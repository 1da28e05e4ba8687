// SPDX-License-Identifier: BSD-3-Clause
#include "report_tables.hpp"

#include <map>

#include "plot.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

// Rows shown without a click; a scene of the benchmark has more than a thousand.
constexpr std::size_t kOpenRows = 100;

std::string cells(const std::vector<std::string>& texts, const char* tag,
                  const std::string& style = "") {
  std::string html = style.empty() ? "<tr>" : "<tr class=\"" + style + "\">";
  for (const std::string& text : texts)
    html += std::string("<") + tag + ">" + escaped(text) + "</" + tag + ">";
  return html + "</tr>\n";
}

// Empty where the truth says nothing: neighbours, and pairs that do not overlap and were not
// reported.
std::string verdict(const EvaluatedPair& judged) {
  if (judged.pair->aligned) return judged.right ? "right" : "wrong";
  return judged.in_truth ? "missed" : "";
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

std::string score_table(const evaluation::Evaluation& e) {
  std::string html = "<h2>Recall and precision</h2>\n<table>\n";
  html += cells({"rule", "right", "true pairs", "reported", "recall", "precision", "raw recall",
                 "R@P50", "R@P80", "R@P95", "R@P99", "AP"},
                "th");
  const auto row = [&](const char* rule, const evaluation::Scores& s,
                       const std::optional<evaluation::RankedScores>& r) {
    std::vector<std::string> texts = {rule,
                                      std::to_string(s.good),
                                      std::to_string(s.ground_truth),
                                      std::to_string(s.reported),
                                      percent(s.recall()) + " %",
                                      percent(s.precision()) + " %"};
    if (r)
      for (const double value : {r->raw_recall, r->recall_at_50, r->recall_at_80, r->recall_at_95,
                                 r->recall_at_99, r->average_precision})
        texts.push_back(percent(value) + " %");
    html += cells(texts, "td");
  };
  row("strict", e.strict, e.strict_ranked);
  if (e.geometric) row("geometric", *e.geometric, e.geometric_ranked);
  return html +
         "</table>\n<p class=\"sub\">Redwood's protocol, pairs with j &minus; i &gt; 1. Strict: a "
         "report that overlaps by less than 30 % is wrong; geometric: right where the pose is "
         "within 0.2 m of the truth. Raw: every best candidate reported. R@P: recall at that "
         "precision; AP: average precision.</p>\n";
}

std::string pair_table(const ResultFile& result, const std::vector<EvaluatedPair>& judged) {
  std::map<const PairRecord*, std::string> verdicts;
  for (const EvaluatedPair& j : judged) verdicts[j.pair] = verdict(j);
  std::vector<std::string> titles = {"target i", "source j", "status",  "reason",
                                     "score",    "rmse, m",  "matches", "survivors",
                                     "scored",   "inliers",  "ms"};
  if (!judged.empty()) titles.push_back("verdict");
  const bool open = result.pairs.size() <= kOpenRows;
  std::string html = "<h2>Every pair</h2>\n<details" + std::string(open ? " open" : "") +
                     "><summary>" + std::to_string(result.pairs.size()) +
                     " pairs</summary>\n<table>\n" + cells(titles, "th");
  for (const PairRecord& pair : result.pairs) {
    std::vector<std::string> texts = {std::to_string(pair.i),
                                      std::to_string(pair.j),
                                      text_of(pair.json, "/status"),
                                      pair.aligned ? "" : pair.reason,
                                      fixed(pair.score, 3),
                                      measure(pair.json, "inlier_rmse", 4),
                                      count_of(pair.json, "correspondences"),
                                      count_of(pair.json, "survivors"),
                                      count_of(pair.json, "scored"),
                                      count_of(pair.json, "inliers"),
                                      fixed(pair.milliseconds, 1)};
    const auto found = verdicts.find(&pair);
    const std::string said = found == verdicts.end() ? "" : found->second;
    if (!judged.empty()) texts.push_back(said);
    html += cells(texts, "td", said);
  }
  html += "</table></details>\n";
  if (!judged.empty())
    html +=
        "<p class=\"sub\">Verdicts: right, the reported pose is within 0.2 m of the truth; "
        "wrong, it is not; missed, the pair overlaps by 30 % or more and was not reported. "
        "Neighbours (j &minus; i = 1) are not judged.</p>\n";
  return html;
}

std::string options_table(const Json& document) {
  const auto options = document.find("options");
  if (options == document.end() || !options->is_object()) return "";
  std::string html = "<h2>Options</h2>\n<table>\n" + cells({"stage", "option", "value"}, "th");
  for (const auto& stage : options->items())
    if (stage.value().is_object())
      for (const auto& option : stage.value().items())
        html += cells({stage.key(), option.key(), option.value().dump()}, "td");
  return html + "</table>\n<p class=\"sub\">Lengths in metres, angles in degrees.</p>\n";
}

}  // namespace gpureg::cli
