// SPDX-License-Identifier: BSD-3-Clause
#include "pages/report_comparison.hpp"

#include <algorithm>

#include "pages/plot.hpp"
#include "pages/report_pairs.hpp"
#include "pages/report_tables.hpp"
#include "text.hpp"

namespace gpureg::cli {
namespace {

constexpr const char* kColors[] = {"#268be6", "#e39a12", "#2f9e5b", "#d6453d", "#7d5bbe",
                                   "#17a2a2", "#c24f94", "#8a6d3b", "#6b7785", "#9aa51b"};

std::vector<std::string> scenes_of(const std::vector<ReportEntry>& entries) {
  std::vector<std::string> scenes;
  for (const ReportEntry& entry : entries)
    if (std::find(scenes.begin(), scenes.end(), entry.scene) == scenes.end())
      scenes.push_back(entry.scene);
  return scenes;
}

std::string td(const std::string& text) { return "<td>" + escaped(text) + "</td>"; }

std::string rule_cells(const std::optional<evaluation::Scores>& scores,
                       const std::optional<evaluation::RankedScores>& ranked) {
  if (!scores) return "<td></td><td></td><td></td><td></td>";
  return td(percent(scores->recall())) +
         td(scores->reported > 0 ? percent(scores->precision()) : "n/a") +
         td(ranked ? percent(ranked->recall_at_95) : "") +
         td(ranked ? percent(ranked->average_precision) : "");
}

std::string row(const ReportEntry& entry, std::size_t index, bool evaluated) {
  const ResultFile& result = entry.result;
  const auto reported = std::count_if(result.pairs.begin(), result.pairs.end(),
                                      [](const PairRecord& pair) { return pair.aligned; });
  std::string html = "<tr><td><a href=\"#" + result_anchor(index) + "\">" + escaped(entry.name) +
                     "</a></td>" + td(std::to_string(result.pairs.size())) +
                     td(std::to_string(reported));
  if (evaluated) {
    const evaluation::Evaluation none;
    const evaluation::Evaluation& e = entry.evaluation ? *entry.evaluation : none;
    html += rule_cells(entry.evaluation ? std::optional(e.strict) : std::nullopt, e.strict_ranked) +
            rule_cells(e.geometric, e.geometric_ranked);
  }
  const auto memory = number_of(result.document, "/peak_memory_mib");
  return html + td(fixed(result.mean_milliseconds(), 1)) +
         td(fixed(result.mean_prepare_milliseconds(), 1)) + td(memory ? fixed(*memory, 0) : "") +
         "</tr>\n";
}

std::string table(const std::vector<ReportEntry>& entries) {
  const bool evaluated = std::any_of(entries.begin(), entries.end(),
                                     [](const ReportEntry& e) { return e.evaluation.has_value(); });
  std::string html = "<div class=\"wide\"><table>\n";
  std::vector<std::string> titles = {"result", "pairs", "reported"};
  if (evaluated) {
    html +=
        "<tr><th colspan=\"3\"></th><th colspan=\"4\">strict, %</th><th colspan=\"4\">geometric, "
        "%</th><th colspan=\"3\"></th></tr>\n";
    for (int rule = 0; rule < 2; ++rule)
      for (const char* title : {"recall", "precision", "R@P95", "AP"}) titles.push_back(title);
  }
  for (const char* title : {"ms per pair", "ms per fragment", "peak MiB"}) titles.push_back(title);
  html += table_row(titles, "th");
  const std::vector<std::string> scenes = scenes_of(entries);
  for (const std::string& scene : scenes) {
    if (scenes.size() > 1)
      html += "<tr class=\"scene\"><td colspan=\"" + std::to_string(titles.size()) + "\">" +
              escaped(scene) + "</td></tr>\n";
    for (std::size_t k = 0; k < entries.size(); ++k)
      if (entries[k].scene == scene) html += row(entries[k], k, evaluated);
  }
  html += "</table></div>\n";
  if (evaluated)
    html +=
        "<p class=\"sub\">Redwood's protocol. Strict: a pair that overlaps by less than 30 % "
        "counts "
        "as false; geometric: every pair counts by its pose. R@P95: recall at 95 % precision. AP: "
        "average precision.</p>\n";
  return html;
}

std::string curve_figure(const std::vector<ReportEntry>& entries, const std::string& scene,
                         bool geometric) {
  std::vector<Curve> curves;
  for (const ReportEntry& entry : entries) {
    if (entry.scene != scene || !entry.evaluation || (geometric && !entry.evaluation->geometric))
      continue;
    const evaluation::Scores& s =
        geometric ? *entry.evaluation->geometric : entry.evaluation->strict;
    curves.push_back({entry.name,
                      kColors[curves.size() % std::size(kColors)],
                      recall_precision(*entry.truth, entry.result, geometric),
                      {s.recall(), s.precision()}});
  }
  if (curves.empty()) return "";
  return "<figure><figcaption>" + escaped(scene) + ", " + (geometric ? "geometric" : "strict") +
         " rule</figcaption>\n" + curve_plot(curves, "recall in %", "precision in %") +
         "</figure>\n";
}

}  // namespace

std::string result_anchor(std::size_t index) { return "result-" + std::to_string(index + 1); }

std::string comparison(const std::vector<ReportEntry>& entries) {
  std::string html = "<h1>gpureg: " + std::to_string(entries.size()) + " results</h1>\n" +
                     "<h2>Comparison</h2>\n" + table(entries);
  for (const std::string& scene : scenes_of(entries)) {
    const std::string figures =
        curve_figure(entries, scene, false) + curve_figure(entries, scene, true);
    if (!figures.empty()) html += "<div class=\"row\">\n" + figures + "</div>\n";
  }
  return html;
}

}  // namespace gpureg::cli
