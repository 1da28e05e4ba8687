// SPDX-License-Identifier: BSD-3-Clause
#include "report_page.hpp"

#include <algorithm>
#include <map>

#include "base64.hpp"
#include "plot.hpp"
#include "report_pairs.hpp"
#include "report_tables.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

constexpr const char* kGreen = "#2f9e5b";
constexpr const char* kRed = "#d6453d";
constexpr const char* kBlue = "#268be6";
constexpr const char* kAmber = "#e39a12";

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>gpureg report</title><style>
body { font: 15px/1.5 system-ui, sans-serif; color: #2b2b2b; background: #fafaf8; max-width: 1000px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.5em; margin-bottom: 0; } h2 { font-size: 1.15em; margin: 1.8em 0 .4em; }
p.sub { color: #777; margin-top: .2em; }
table { border-collapse: collapse; } th, td { padding: .25em .8em; text-align: right; border-bottom: 1px solid #e4e4de; }
th { font-weight: 600; color: #555; } th:first-child, td:first-child { text-align: left; }
.row { display: flex; flex-wrap: wrap; gap: 24px; } figure { margin: 0 0 1.2em; } figcaption { color: #555; }
details { overflow-x: auto; } summary { cursor: pointer; color: #555; margin-bottom: .4em; } details td, details th { padding: .1em .6em; font-size: 13px; }
svg { max-width: 100%; height: auto; } svg text { font: 12px system-ui, sans-serif; fill: #444; }
img { max-width: 100%; border: 1px solid #e4e4de; } .right { color: #2f9e5b; } .wrong { color: #d6453d; } .missed { color: #b97a00; }
</style></head><body>
)";

std::optional<double> number_of(const Json& json, const char* pointer) {
  const Json::json_pointer at(pointer);
  if (!json.contains(at) || !json.at(at).is_number()) return std::nullopt;
  return json.at(at).get<double>();
}

std::string tries_per_pair(const Json& document) {
  return text_of(document, "/options/hypothesis/proposal") == "compatibility"
             ? text_of(document, "/options/compatibility/seeds") + " seeds per pair"
             : text_of(document, "/options/hypothesis/count") + " hypotheses per pair";
}

std::string opening(const ResultFile& result) {
  const Json& d = result.document;
  std::string html = "<h1>gpureg: " + escaped(base_name(text_of(d, "/folder"))) + "</h1>\n";
  html += "<p class=\"sub\">gpureg " + escaped(text_of(d, "/environment/version")) + " on " +
          escaped(text_of(d, "/environment/description")) + " &middot; voxel size " +
          escaped(text_of(d, "/options/prepare/voxel_size")) + " m &middot; " +
          escaped(tries_per_pair(d)) + " &middot; seed " +
          escaped(text_of(d, "/options/hypothesis/seed")) + "</p>\n";
  const auto aligned = std::count_if(result.pairs.begin(), result.pairs.end(),
                                     [](const PairRecord& pair) { return pair.aligned; });
  const std::size_t fragments =
      d.contains("fragments") && d["fragments"].is_array() ? d["fragments"].size() : 0;
  html += "<p>" + std::to_string(result.pairs.size()) + " pairs of " + std::to_string(fragments) +
          " fragments were tried, " + std::to_string(aligned) + " reported as aligned. ";
  html += "A pair took " + significant(result.mean_milliseconds(), 3) +
          " ms on average, the preparation of a fragment " +
          significant(result.mean_prepare_milliseconds(), 3) + " ms";
  if (const auto memory = number_of(d, "/peak_memory_mib"))
    html += "; peak memory " + fixed(*memory, 0) + " MiB";
  return html + ".</p>\n";
}

std::string figure(const std::string& title, const std::string& content) {
  return "<figure><figcaption>" + escaped(title) + "</figcaption>\n" + content + "</figure>\n";
}

// From which score on pairs were reported.
auto threshold(const ResultFile& result) {
  const bool quadruples = text_of(result.document, "/options/hypothesis/proposal") == "quadruples";
  return number_of(result.document,
                   quadruples ? "/options/score/min_inlier_ratio" : "/options/min_confidence");
}

std::string truth_plots(const ResultFile& result, const evaluation::GroundTruth& truth,
                        const evaluation::Evaluation& e) {
  std::vector<Curve> curves;
  const auto add = [&](const char* name, const char* color, bool geometric,
                       const evaluation::Scores& s) {
    curves.push_back(
        {name, color, recall_precision(truth, result, geometric), {s.recall(), s.precision()}});
  };
  if (e.geometric) add("geometric", kBlue, true, *e.geometric);
  add("strict", kAmber, false, e.strict);
  Population right{"right", kGreen, {}}, wrong{"wrong", kRed, {}};
  for (const EvaluatedPair& judged : judge(truth, result))
    if (judged.pair->transform) (judged.right ? right : wrong).values.push_back(judged.pair->score);
  return "<div class=\"row\">\n" +
         figure("Recall and precision while the threshold falls; the dots are this run's",
                curve_plot(curves, "recall in %", "precision in %")) +
         figure("Scores of the best candidates",
                histogram_plot({right, wrong}, "score", threshold(result))) +
         "</div>\n";
}

std::string score_plot(const ResultFile& result) {
  Population aligned{"reported", kBlue, {}}, rejected{"not reported", kAmber, {}};
  for (const PairRecord& pair : result.pairs)
    if (pair.transform) (pair.aligned ? aligned : rejected).values.push_back(pair.score);
  return figure("Scores of the best candidates",
                histogram_plot({aligned, rejected}, "score", threshold(result)));
}

// Means of the objects "ms" in a list, in the order of the stages.
std::vector<Bar> stage_bars(const std::vector<const Json*>& records, const char* color) {
  std::vector<Bar> bars;
  for (const Json* ms : records)
    for (const auto& stage : ms->items()) {
      if (stage.key() == "total" || !stage.value().is_number()) continue;
      auto bar = std::find_if(bars.begin(), bars.end(),
                              [&](const Bar& b) { return b.name == stage.key(); });
      if (bar == bars.end()) bar = bars.insert(bars.end(), {stage.key(), color, 0});
      bar->value += stage.value().get<double>() / static_cast<double>(records.size());
    }
  return bars;
}

std::string time_plots(const ResultFile& result) {
  std::vector<const Json*> fragments, pairs;
  if (result.document.contains("fragments"))
    for (const Json& fragment : result.document["fragments"])
      if (fragment.contains("ms")) fragments.push_back(&fragment["ms"]);
  for (const PairRecord& pair : result.pairs) pairs.push_back(&pair.json["ms"]);
  return "<h2>Time</h2>\n<div class=\"row\">\n" +
         figure("Preparation, mean per fragment", bar_plot(stage_bars(fragments, kAmber), "ms")) +
         figure("Alignment, mean per pair", bar_plot(stage_bars(pairs, kBlue), "ms")) + "</div>\n";
}

std::string picture_list(const std::vector<Picture>& pictures) {
  if (pictures.empty()) return "";
  const std::map<std::string, std::string> classes = {{"Right", "right"},
                                                      {"Aligned", "right"},
                                                      {"Wrong", "wrong"},
                                                      {"Missed", "missed"},
                                                      {"Not aligned", "missed"}};
  std::string html = "<h2>Pairs to look at</h2>\n";
  for (const Picture& picture : pictures) {
    const auto found = classes.find(picture.heading);
    html += "<figure><figcaption><b class=\"" +
            (found == classes.end() ? std::string() : found->second) + "\">" +
            escaped(picture.heading) + "</b> &middot; " + escaped(picture.remark) +
            "</figcaption>\n<img alt=\"before and after\" src=\"data:image/png;base64," +
            base64(picture.png) + "\"></figure>\n";
  }
  return html;
}

}  // namespace

std::string report_page(const ResultFile& result,
                        const std::optional<evaluation::GroundTruth>& truth,
                        const std::vector<Picture>& pictures) {
  std::string html = kHead + opening(result);
  if (truth) {
    const evaluation::Evaluation e = evaluation::evaluate(*truth, result.reports, true);
    html += score_table(e) + truth_plots(result, *truth, e);
  } else {
    html += score_plot(result);
  }
  return html + time_plots(result) + picture_list(pictures) +
         pair_table(result, truth ? judge(*truth, result) : std::vector<EvaluatedPair>()) +
         options_table(result.document) + "</body></html>\n";
}

}  // namespace gpureg::cli
