// SPDX-License-Identifier: BSD-3-Clause
#include "records/result_json.hpp"

#include <sys/resource.h>

#include <fstream>
#include <string>

#include "json/json.hpp"

namespace gpureg::cli {

Json to_json(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  Json numbers = Json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column)
      numbers.push_back(matrix(row, column));
  return numbers;
}

Json mode_json(const RegistrationMode& mode, const char* pose_name) {
  return {{pose_name, to_json(mode.target_from_source.matrix())},
          {"confidence", mode.confidence},
          {"overlap_confidence", mode.overlap_confidence},
          {"equivalent", mode.equivalent},
          {"evidence", to_json(mode.evidence)}};
}

Json to_json(const RegistrationResult& result, const char* pose_name) {
  Json json;
  json["status"] = to_string(result.status);
  json["reason"] = to_string(result.reason);
  if (!result.aligned()) json["explanation"] = explain(result);
  json["confidence"] = result.confidence;
  if (result.flat) json["flat"] = true;
  json["inlier_ratio"] = result.inlier_ratio;
  json["inlier_rmse"] = result.inlier_rmse;
  json[pose_name] = result.has_pose() ? to_json(result.target_from_source.matrix()) : Json(nullptr);
  if (!result.modes.empty()) {
    json["symmetry"] = {{"equivalent_poses", result.equivalent_poses()},
                        {"confidence", result.symmetry_confidence()}};
    json["modes"] = Json::array();
    for (const RegistrationMode& mode : result.modes)
      json["modes"].push_back(mode_json(mode, pose_name));
  }
  json["statistics"] = to_json(result.statistics);
  json["ms"] = to_json(result.timings);
  return json;
}

Json scale_to_json(const ScaledResult& found, const char* pose_name) {
  Json out;
  out[pose_name] = nullptr;
  if (found.result.has_pose()) out[pose_name] = to_json(found.similarity());
  out["scale"] = nullptr;
  if (found.scale_status != ScaleStatus::none) out["scale"] = found.scale;
  out["scale_status"] = to_string(found.scale_status);
  out["scale_deviation"] = found.scale_deviation;
  out["scale_information"] = to_json(found.information);
  out["scales"] = Json::array();
  for (const ScaleCandidate& c : found.candidates)
    out["scales"].push_back({{"scale", c.scale}, {"confidence", c.confidence}});
  if (!found.aligned()) out["explanation"] = explain(found);
  return out;
}

Json environment(const Context& context) {
  return {{"version", GPUREG_VERSION},
          {"backend", to_string(context.backend())},
          {"description", context.description()}};
}

double peak_memory_mib() {
  // getrusage also counts the program that started this one, from before exec: a script that holds
  // a gigabyte would be reported as ours.
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key; std::getline(status, key))
    if (double kib = 0; key == "VmHWM:" && status >> kib) return kib / 1024.0;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;  // Linux counts in KiB
}

}  // namespace gpureg::cli
