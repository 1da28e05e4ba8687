// SPDX-License-Identifier: BSD-3-Clause
#include "pages/report_page.hpp"

#include "pages/page.hpp"
#include "pages/report_pairs.hpp"
#include "records/evaluation_json.hpp"

namespace gpureg::cli {
namespace {

/// The members of that name which an object has.
Json members(const Json& object, const std::vector<const char*>& names) {
  Json out = Json::object();
  for (const char* name : names)
    if (const auto found = object.find(name); found != object.end()) out[name] = *found;
  return out;
}

Json fragment_times(const Json& fragments) {
  Json times = Json::array();
  for (const Json& fragment : fragments)
    if (fragment.is_object() && fragment.contains("ms") && fragment["ms"].is_object())
      times.push_back(fragment["ms"]);
  return times;
}

/// Moves the pairs of the entry.
Json entry_json(ReportEntry& entry) {
  const ResultFile& result = entry.result;
  const Json& document = result.document;
  Json json = members(document, {"environment", "options", "peak_memory_mib"});
  const Json fragments = document.value("fragments", Json());
  json["name"] = entry.name;
  json["scene"] = entry.scene;
  json["fragment_count"] = fragments.is_array() ? fragments.size() : 0;
  json["fragments"] = fragment_times(fragments.is_array() ? fragments : Json::array());
  for (std::size_t k = 0; k < result.pairs.size(); ++k) {
    const PairRecord& pair = result.pairs[k];
    entry.pairs[k].update({{"i", result.label_of(pair.i)},
                           {"j", result.label_of(pair.j)},
                           {"aligned", pair.aligned},
                           {"reason", pair.reason},
                           {"confidence", pair.confidence},
                           {"has_pose", pair.transform.has_value()},
                           {"milliseconds", pair.milliseconds}});
  }
  if (entry.truth) {
    for (const EvaluatedPair& pair : evaluate_pairs(*entry.truth, result))
      entry.pairs[static_cast<std::size_t>(pair.pair - result.pairs.data())].update(
          {{"correct", pair.correct}, {"in_truth", pair.in_truth}});
    json["evaluation"] = to_json(*entry.evaluation);
    add_curves(json["evaluation"], *entry.truth, result);
  }
  json["pairs"] = std::move(entry.pairs);
  json["pictures"] = Json::array();
  for (const Picture& picture : entry.pictures)
    json["pictures"].push_back(
        {{"heading", picture.heading}, {"caption", picture.caption}, {"png", base64(picture.png)}});
  return json;
}

}  // namespace

Json pair_row(const Json& pair) {
  Json row = members(pair, {"status", "inlier_rmse", "ms"});
  if (const auto counts = pair.find("statistics"); counts != pair.end() && counts->is_object())
    row["statistics"] = members(*counts, {"correspondences", "survivors", "scored", "inliers"});
  return row;
}

std::string report_page(std::vector<ReportEntry> entries) {
  Json data = Json::array();
  for (ReportEntry& entry : entries) data.push_back(entry_json(entry));
  return filled(kReportPage, "gpureg report", data);
}

}  // namespace gpureg::cli
