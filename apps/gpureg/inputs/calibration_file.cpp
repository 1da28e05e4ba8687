// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/calibration_file.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "gpureg/error.hpp"
#include "inputs/scene_file.hpp"
#include "json/fields_json.hpp"
#include "json/json.hpp"
#include "json/json_file.hpp"

namespace gpureg::cli {
namespace {

constexpr const char* kKind = "calibration";

Json to_json(const CalibrationCount& count) {
  return {{"pairs", count.pairs}, {"samples", count.samples}, {"correct", count.correct}};
}

Json to_json(const PromisedRisk& risk) {
  const RiskThreshold& found = risk.threshold;
  Json json = {{"max_risk", risk.control.max_risk},
               {"max_failure", risk.control.max_failure},
               {"supported", found.supported},
               {"samples", found.samples}};
  json[found.scenes > 0 ? "scenes" : "scans"] = found.scenes > 0 ? found.scenes : found.scans;
  if (found.supported)
    json.update({{"min_confidence", found.min_confidence},
                 {"reported", found.reported},
                 {"false", found.wrong},
                 {"recall", found.recall}});
  else if (found.scenes > 0)
    json["more_scenes"] = found.more_scenes ? Json(*found.more_scenes) : Json();
  else
    json["more_scans"] = found.more_scans ? Json(*found.more_scans) : Json();
  return json;
}

double number(const std::string& path, const Json& document, const char* field,
              const char* expected, bool positive) {
  const auto found = document.find(field);
  const bool fine = found != document.end() && found->is_number() &&
                    std::isfinite(found->get<double>()) && (!positive || found->get<double>() > 0);
  if (!fine)
    throw IoError(
        path + ": \"" + field + "\" is " +
        (found == document.end()
             ? "missing"
             : found->dump(-1, ' ', false, Json::error_handler_t::replace).substr(0, 40)) +
        ", expected " + expected);
  return found->get<double>();
}

}  // namespace

Json read_calibration_document(const std::string& path) {
  Json document = DocumentFile(path).read();
  const auto kind = document.is_object() ? document.find("gpureg") : document.end();
  if (!document.is_object() || kind == document.end() || *kind != kKind)
    throw IoError(path + ": no calibration of `gpureg calibrate`, \"gpureg\" is not \"" +
                  std::string(kKind) + "\"");
  return document;
}

Json calibration_document(const CalibrationResult& result, const RegistrationOptions& options,
                          unsigned quality, const std::vector<std::uint64_t>& clouds,
                          const std::optional<PromisedRisk>& risk) {
  Json json;
  json["gpureg"] = kKind;
  json["version"] = GPUREG_VERSION;
  json["slope"] = result.calibration.slope;
  json["offset"] = result.calibration.offset;
  json["enough_samples"] = result.enough_samples;
  json["samples"] = {{"one_scan", to_json(result.one_scan)},
                     {"loop_consistency", to_json(result.loop_consistency)},
                     {"trajectory", to_json(result.trajectory)}};
  json["calibration_error"] = {{"before", result.error_before}, {"after", result.error_after}};
  json["voxel_size"] = to_json(options)["voxel_size"];
  json["preset"] = "default";  // the only one with a confidence
  json["quality"] = quality;
  json["options"] = scene_options(options);
  json["clouds"] = clouds;
  Json confidences = Json::array(), correct = Json::array();
  for (const CalibrationSample& sample : result.of_two_scans()) {
    confidences.push_back(sample.confidence);
    correct.push_back(sample.correct);
  }
  json["decided_pairs"] = {{"confidence", std::move(confidences)}, {"correct", std::move(correct)}};
  if (risk) json["risk"] = to_json(*risk);
  return json;
}

CalibrationFile read_calibration(const std::string& path) {
  const Json document = read_calibration_document(path);
  CalibrationFile out;
  out.calibration.slope = number(path, document, "slope", "a number > 0", true);
  out.calibration.offset = number(path, document, "offset", "a number", false);
  out.voxel_size = number(path, document, "voxel_size", "a length > 0", true);
  const auto risk = document.find("risk");
  if (risk != document.end() && risk->is_object() && risk->contains("min_confidence")) {
    constexpr const char* kExpected = "a probability in (0, 1]";
    out.min_confidence = number(path, *risk, "min_confidence", kExpected, true);
    if (*out.min_confidence > 1)
      throw IoError(path + ": \"min_confidence\" is " + (*risk)["min_confidence"].dump() +
                    ", expected " + kExpected);
  }
  return out;
}

}  // namespace gpureg::cli
