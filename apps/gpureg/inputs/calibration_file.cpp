// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/calibration_file.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "gpureg/error.hpp"
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
  if (found.scenes > 0) json["scenes"] = found.scenes;
  if (found.supported)
    json.update({{"min_confidence", found.min_confidence},
                 {"reported", found.reported},
                 {"false", found.wrong},
                 {"recall", found.recall}});
  else if (found.scenes > 0)
    json["more_scenes"] = found.more_scenes ? Json(*found.more_scenes) : Json();
  else
    json["more_samples"] = found.more_samples ? Json(*found.more_samples) : Json();
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

Json document_of(const std::string& path) {
  Json document = DocumentFile(path).read();
  const auto kind = document.is_object() ? document.find("gpureg") : document.end();
  if (!document.is_object() || kind == document.end() || *kind != kKind)
    throw IoError(path + ": no calibration of `gpureg calibrate`, \"gpureg\" is not \"" +
                  std::string(kKind) + "\"");
  return document;
}

}  // namespace

Json calibration_document(const CalibrationResult& result, const RegistrationOptions& options,
                          unsigned quality, const std::optional<PromisedRisk>& risk) {
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
  json["voxel_size"] = to_json(options)["prepare"]["voxel_size"];
  json["preset"] = "default";  // the only one with a confidence
  json["quality"] = quality;
  Json confidences = Json::array(), correct = Json::array();
  for (const CalibrationSample& sample : result.of_two_scans()) {
    confidences.push_back(sample.confidence);
    correct.push_back(sample.correct);
  }
  json["decided_pairs"] = {{"confidence", std::move(confidences)}, {"correct", std::move(correct)}};
  if (risk) json["risk"] = to_json(*risk);
  return json;
}

std::vector<CalibrationSample> read_decided_pairs(const std::string& path) {
  const Json document = document_of(path);
  const auto list = [&](const char* field) {
    const auto pairs = document.find("decided_pairs");
    if (pairs == document.end() || !pairs->is_object()) return Json::array();
    return pairs->value(field, Json::array());
  };
  const Json confidences = list("confidence"), correct = list("correct");
  const auto all = [](const Json& values, bool (Json::*is)() const noexcept) {
    return values.is_array() &&
           std::all_of(values.begin(), values.end(), [&](const Json& v) { return (v.*is)(); });
  };
  if (!all(confidences, &Json::is_number) || !all(correct, &Json::is_boolean) ||
      confidences.empty() || confidences.size() != correct.size())
    throw IoError(path + ": \"decided_pairs\" has no confidences and labels of pairs");
  std::vector<CalibrationSample> out;
  for (std::size_t k = 0; k < confidences.size(); ++k)
    out.push_back({confidences[k].get<double>(), correct[k].get<bool>()});
  return out;
}

CalibrationFile read_calibration(const std::string& path) {
  const Json document = document_of(path);
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
