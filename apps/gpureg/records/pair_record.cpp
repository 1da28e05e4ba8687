// SPDX-License-Identifier: BSD-3-Clause
#include "records/pair_record.hpp"

#include <algorithm>
#include <cmath>

#include "gpureg/error.hpp"
#include "gpureg/reconstruction.hpp"
#include "records/result_json.hpp"

namespace gpureg::cli {
namespace {

const Json& member(const Json& json, const char* name) {
  if (!json.is_object()) throw InvalidArgument("a pair is no object");
  const auto found = json.find(name);
  if (found == json.end()) throw InvalidArgument(std::string("a pair lacks \"") + name + "\"");
  return *found;
}

int index(const Json& json, const char* name) {
  const Json& value = member(json, name);
  if (!value.is_number_integer() || value.get<std::int64_t>() < 0 ||
      value.get<std::int64_t>() > 0x7fffffff)
    throw InvalidArgument(std::string("\"") + name + "\" of a pair is " + value.dump() +
                          ", expected the number of a fragment");
  return value.get<int>();
}

std::string text(const Json& json, const char* name) {
  const Json& value = member(json, name);
  if (!value.is_string())
    throw InvalidArgument(std::string("\"") + name + "\" of a pair is " + value.dump() +
                          ", expected a text");
  return value.get<std::string>();
}

double number(const Json& value, const char* name) {
  // Infinity and NaN cannot be written in JSON, but 1e999 can be read.
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    throw InvalidArgument(std::string("\"") + name + "\" holds " + value.dump() +
                          ", expected a finite number");
  return value.get<double>();
}

template <int Size>
Eigen::Matrix<double, Size, Size> square(const Json& json, const char* name) {
  if (!json.is_array() || json.size() != Size * Size)
    throw InvalidArgument(std::string("\"") + name + "\" is not an array of " +
                          std::to_string(Size * Size) + " numbers");
  Eigen::Matrix<double, Size, Size> matrix;
  for (int k = 0; k < Size * Size; ++k)
    matrix(k / Size, k % Size) = number(json[static_cast<std::size_t>(k)], name);
  return matrix;
}

}  // namespace

PairRecord PairRecord::from_result(int i, int j, const RegistrationResult& result) {
  Json json = {{"i", i}, {"j", j}};
  json.update(to_json(result, "T_ij"));
  return from_json(json);
}

PairRecord PairRecord::from_json(const Json& json) {
  PairRecord record;
  record.i = index(json, "i");
  record.j = index(json, "j");
  const std::string status = text(json, "status");
  record.aligned = status == to_string(RegistrationStatus::aligned) ||
                   status == to_string(RegistrationStatus::aligned_up_to_symmetry);
  record.reason = text(json, "reason");
  record.score = number(member(json, "score"), "score");
  const Json& pose = member(json, "T_ij");
  if (!pose.is_null()) record.transform = square<4>(pose, "T_ij");
  // The first mode is the pose itself.
  if (const auto modes = json.find("modes");
      modes != json.end() && modes->is_array() && !modes->empty())
    record.strict_score =
        number(member(modes->front(), "overlap_confidence"), "overlap_confidence");
  if (record.aligned && !record.transform)
    throw InvalidArgument("a pair is aligned, but its \"T_ij\" is null");
  const Json& ms = member(json, "ms");
  record.milliseconds = number(member(ms, "total"), "total");
  record.json = json;
  return record;
}

std::vector<RegistrationMode> modes_from_json(const Json& pair) {
  std::vector<RegistrationMode> modes;
  const auto found = pair.find("modes");
  if (found == pair.end()) return modes;
  if (!found->is_array()) throw InvalidArgument("\"modes\" of a pair is no array");
  for (const Json& json : *found) {
    RegistrationMode mode;
    mode.target_from_source.matrix() = square<4>(member(json, "T_ij"), "T_ij");
    mode.confidence = number(member(json, "confidence"), "confidence");
    mode.equivalent = json.value("equivalent", false);
    if (const auto evidence = json.find("evidence");
        evidence != json.end() && evidence->is_object())
      read_json(*evidence, mode.evidence);
    modes.push_back(mode);
  }
  return modes;
}

RegistrationResult result_from_record(const PairRecord& record, const Json& information) {
  RegistrationResult result;
  result.status = record.aligned ? RegistrationStatus::aligned : RegistrationStatus::not_aligned;
  result.reason = RegistrationReason::none;
  for (int k = 0; k <= static_cast<int>(RegistrationReason::cancelled); ++k)
    if (record.reason == to_string(static_cast<RegistrationReason>(k)))
      result.reason = static_cast<RegistrationReason>(k);
  result.has_candidate = record.transform.has_value();
  if (result.has_candidate) result.target_from_source.matrix() = *record.transform;
  result.score = record.score;
  result.modes = modes_from_json(record.json);
  if (!information.is_null())
    result.source_moments =
        reconstruction::moments_of_information(information_from_json(information));
  return result;
}

Eigen::Matrix<double, 6, 6> information_from_json(const Json& json) {
  return square<6>(json, "information");
}

}  // namespace gpureg::cli
