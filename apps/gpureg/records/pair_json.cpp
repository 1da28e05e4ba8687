// SPDX-License-Identifier: BSD-3-Clause
#include "records/pair_json.hpp"

#include "json/json_fields.hpp"
#include "records/result_json.hpp"

namespace gpureg::cli {
namespace {

RegistrationStatus status_of(const std::string& text) {
  for (const auto status :
       {RegistrationStatus::aligned, RegistrationStatus::aligned_up_to_symmetry})
    if (text == to_string(status)) return status;
  return RegistrationStatus::not_aligned;
}

/// Other programs have reasons of their own.
RegistrationReason reason_of(const std::string& text) {
  for (int k = 0; k <= static_cast<int>(kLastRegistrationReason); ++k)
    if (text == to_string(static_cast<RegistrationReason>(k)))
      return static_cast<RegistrationReason>(k);
  return RegistrationReason::none;
}

RegistrationMode mode_from_json(const Json& json) {
  RegistrationMode mode;
  mode.target_from_source.matrix() = rigid_motion(member(json, "T_ij"), "T_ij");
  mode.confidence = finite_number(member(json, "confidence"), "confidence");
  if (const auto found = json.find("overlap_confidence"); found != json.end())
    mode.overlap_confidence = finite_number(*found, "overlap_confidence");
  mode.equivalent = json.value("equivalent", false);
  if (const auto found = json.find("evidence"); found != json.end())
    read_json(*found, mode.evidence);
  return mode;
}

}  // namespace

Json pair_to_json(int i, int j, const RegistrationResult& result) {
  Json json = {{"i", i}, {"j", j}};
  json.update(to_json(result, "T_ij"));
  return json;
}

PairRecord record_from_json(const Json& pair) {
  PairRecord record;
  record.i = fragment_member(pair, "i");
  record.j = fragment_member(pair, "j");
  const RegistrationStatus status = status_of(text_member(pair, "status"));
  record.aligned = status != RegistrationStatus::not_aligned;
  record.reason = text_member(pair, "reason");
  if (const auto text = pair.find("explanation"); text != pair.end() && text->is_string())
    record.explanation = text->get<std::string>();
  // Other programs have scores, which are no probabilities.
  const char* confidence =
      pair.contains("confidence") || !pair.contains("score") ? "confidence" : "score";
  record.confidence = finite_number(member(pair, confidence), confidence);
  const Json& pose = member(pair, "T_ij");
  if (!pose.is_null()) record.transform = rigid_motion(pose, "T_ij");
  // The first mode is the pose itself.
  if (const auto modes = pair.find("modes");
      modes != pair.end() && modes->is_array() && !modes->empty())
    record.overlap_confidence =
        finite_number(member(modes->front(), "overlap_confidence"), "overlap_confidence");
  if (record.aligned && !record.transform)
    throw InvalidArgument("a pair is aligned, but its \"T_ij\" is null");
  record.milliseconds = finite_number(member(member(pair, "ms"), "total"), "total");
  return record;
}

std::vector<RegistrationMode> modes_from_json(const Json& pair) {
  std::vector<RegistrationMode> modes;
  const auto found = pair.find("modes");
  if (found == pair.end()) return modes;
  if (!found->is_array()) throw InvalidArgument("\"modes\" of a pair is no array");
  modes.reserve(found->size());
  for (const Json& mode : *found) modes.push_back(mode_from_json(mode));
  return modes;
}

RegistrationResult result_from_json(const Json& pair) {
  const PairRecord record = record_from_json(pair);
  RegistrationResult result;
  result.status = status_of(text_member(pair, "status"));
  result.reason = reason_of(record.reason);
  if (record.transform) result.target_from_source.matrix() = *record.transform;
  result.confidence = record.confidence;
  result.flat = pair.value("flat", false);
  if (const auto found = pair.find("inlier_ratio"); found != pair.end())
    result.inlier_ratio = number_or_nan(*found, "inlier_ratio");
  if (const auto found = pair.find("inlier_rmse"); found != pair.end())
    result.inlier_rmse = number_or_nan(*found, "inlier_rmse");
  result.modes = modes_from_json(pair);
  if (const auto found = pair.find("statistics"); found != pair.end())
    read_json(*found, result.statistics);
  read_json(member(pair, "ms"), result.timings);
  return result;
}

}  // namespace gpureg::cli
