// SPDX-License-Identifier: BSD-3-Clause
#include "pages/report_page.hpp"

#include <algorithm>
#include <map>

#include "pages/base64.hpp"
#include "pages/plot.hpp"
#include "pages/report_comparison.hpp"
#include "pages/report_pairs.hpp"
#include "pages/report_tables.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

constexpr const char* kGreen = "#2f9e5b";
constexpr const char* kRed = "#d6453d";
constexpr const char* kPlotBlue = "#268be6";
constexpr const char* kAmber = "#e39a12";

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>gpureg report</title><style>
body { font: 15px/1.5 system-ui, sans-serif; color: #2b2b2b; background: #fafaf8; max-width: 1000px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.5em; margin-bottom: 0; } h2 { font-size: 1.15em; margin: 1.8em 0 .4em; }
h1.result { margin-top: 2em; padding-top: .8em; border-top: 2px solid #d8d8d0; }
p.sub { color: #666; margin-top: .2em; } .wide { overflow-x: auto; } .wide td, .wide th { padding: .25em .55em; font-size: 13px; } .wide td { white-space: nowrap; } th[colspan] { text-align: center; }
tr.scene td { font-weight: 600; padding-top: .7em; } table.options td, table.options th { text-align: left; } a { color: #1f6fb8; }
table { border-collapse: collapse; } th, td { padding: .25em .8em; text-align: right; border-bottom: 1px solid #e4e4de; }
th { font-weight: 600; color: #555; } th:first-child, td:first-child { text-align: left; }
.row { display: flex; flex-wrap: wrap; gap: 24px; } .row figure { max-width: 460px; } figure { margin: 0 0 1.2em; } figcaption { color: #555; }
details { overflow-x: auto; } summary { cursor: pointer; color: #555; margin-bottom: .4em; } details td, details th { padding: .1em .6em; font-size: 13px; }
svg { max-width: 100%; height: auto; } svg text { font: 12px system-ui, sans-serif; fill: #444; }
img { max-width: 100%; border: 1px solid #e4e4de; } .correct { color: #2f9e5b; } .false { color: #d6453d; } .missed { color: #b97a00; }
</style></head><body>
)";

// Empty where the result does not tell, as with results of other programs.
std::string effort_per_pair(const Json& document) {
  const bool quadruples = text_of(document, "/options/method") == "quadruples";
  const std::string count =
      text_of(document, quadruples ? "/options/quadruples" : "/options/quality");
  return count.empty() ? "" : quadruples ? count + " hypotheses per pair" : "quality " + count;
}

std::string run_facts(const Json& document) {
  const auto fact = [&](const char* before, const char* pointer, const char* after) {
    const std::string text = text_of(document, pointer);
    return text.empty() ? "" : before + text + after;
  };
  std::string facts;
  for (const std::string& text :
       {fact("gpureg ", "/environment/version", "") + fact(" on ", "/environment/description", ""),
        fact("voxel size ", "/options/voxel_size", ""), effort_per_pair(document),
        fact("random seed ", "/options/seed", "")})
    if (!text.empty()) facts += (facts.empty() ? "" : " &middot; ") + escaped(text);
  return facts.empty() ? "" : "<p class=\"sub\">" + facts + "</p>\n";
}

std::string summary(const ResultFile& result) {
  const Json& d = result.document;
  const auto aligned = std::count_if(result.pairs.begin(), result.pairs.end(),
                                     [](const PairRecord& pair) { return pair.aligned; });
  const std::size_t fragments =
      d.contains("fragments") && d["fragments"].is_array() ? d["fragments"].size() : 0;
  std::map<std::string, std::size_t> reasons;
  for (const PairRecord& pair : result.pairs)
    if (!pair.aligned) ++reasons[pair.reason];
  std::string html = run_facts(d) + "<p>" + std::to_string(result.pairs.size()) +
                     (result.pairs.size() == 1 ? " pair of " : " pairs of ") +
                     std::to_string(fragments) + " fragments were tried, " +
                     std::to_string(aligned) + " reported as aligned. ";
  if (!reasons.empty())
    html += std::to_string(result.pairs.size() - static_cast<std::size_t>(aligned)) +
            " are not: " + escaped(counted(reasons)) + ". ";
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

// The lowest score of a reported pair.
auto threshold(const ResultFile& result) {
  return number_of(result.document, "/options/min_confidence");
}

std::string truth_plots(const ResultFile& result, const evaluation::GroundTruth& truth,
                        const evaluation::Evaluation& e) {
  std::vector<Curve> curves;
  const auto add = [&](const char* name, const char* color, bool geometric,
                       const evaluation::Scores& s) {
    curves.push_back(
        {name, color, recall_precision(truth, result, geometric), {s.recall(), s.precision()}});
  };
  if (e.geometric) add("geometric", kPlotBlue, true, *e.geometric);
  add("strict", kAmber, false, e.strict);
  Population correct{"correct", kGreen, {}}, incorrect{"false", kRed, {}};
  for (const EvaluatedPair& pair : evaluate_pairs(truth, result))
    if (pair.pair->transform)
      (pair.correct ? correct : incorrect).values.push_back(pair.pair->score);
  return "<div class=\"row\">\n" +
         figure("Recall and precision by score threshold; dot: this run",
                curve_plot(curves, "recall in %", "precision in %")) +
         figure("Scores of the best candidates",
                histogram_plot({correct, incorrect}, "score", threshold(result))) +
         "</div>\n";
}

std::string score_plot(const ResultFile& result) {
  Population aligned{"reported", kPlotBlue, {}}, rejected{"not reported", kAmber, {}};
  for (const PairRecord& pair : result.pairs)
    if (pair.transform) (pair.aligned ? aligned : rejected).values.push_back(pair.score);
  return figure("Scores of the best candidates",
                histogram_plot({aligned, rejected}, "score", threshold(result)));
}

std::string time_plots(const ReportEntry& entry) {
  StageTimes fragments;
  if (const auto found = entry.result.document.find("fragments");
      found != entry.result.document.end())
    for (const Json& fragment : *found)
      if (fragment.contains("ms")) fragments.add(fragment["ms"]);
  return "<h2>Time</h2>\n<div class=\"row\">\n" +
         figure("Preparation, mean per fragment", bar_plot(fragments.bars(kAmber), "ms")) +
         figure("Alignment, mean per pair", bar_plot(entry.stages.bars(kPlotBlue), "ms")) +
         "</div>\n";
}

std::string picture_list(const std::vector<Picture>& pictures) {
  if (pictures.empty()) return "";
  const std::map<std::string, std::string> classes = {{"Correct", "correct"},
                                                      {"Aligned", "correct"},
                                                      {"False positive", "false"},
                                                      {"Missed", "missed"},
                                                      {"Not aligned", "missed"}};
  std::string html = "<h2>Pictures of pairs</h2>\n";
  for (const Picture& picture : pictures) {
    const auto found = classes.find(picture.heading);
    html += "<figure><figcaption><b class=\"" +
            (found == classes.end() ? std::string() : found->second) + "\">" +
            escaped(picture.heading) + "</b> &middot; " + escaped(picture.caption) +
            "</figcaption>\n<img alt=\"source and target before and after alignment\" "
            "src=\"data:image/png;base64," +
            base64(picture.png) + "\"></figure>\n";
  }
  return html;
}

std::string body(const ReportEntry& entry, bool unfolded) {
  std::string html = summary(entry.result);
  std::vector<EvaluatedPair> pairs;
  if (entry.truth) {
    pairs = evaluate_pairs(*entry.truth, entry.result);
    html +=
        score_table(*entry.evaluation) + truth_plots(entry.result, *entry.truth, *entry.evaluation);
  } else {
    html += score_plot(entry.result);
  }
  return html + time_plots(entry) + picture_list(entry.pictures) +
         pair_table(entry.result, entry.rows, pairs, unfolded) +
         options_table(entry.result.document, unfolded);
}

}  // namespace

std::string report_page(const std::vector<ReportEntry>& entries) {
  std::string html = kHead;
  if (entries.size() == 1) {
    html +=
        "<h1>gpureg: " + escaped(entries.front().scene) + "</h1>\n" + body(entries.front(), true);
  } else {
    html += comparison(entries);
    for (std::size_t k = 0; k < entries.size(); ++k)
      html += "<h1 class=\"result\" id=\"" + result_anchor(k) + "\">" + escaped(entries[k].name) +
              "</h1>\n" + body(entries[k], false);
  }
  return html + "</body></html>\n";
}

}  // namespace gpureg::cli
