// SPDX-License-Identifier: BSD-3-Clause
#include "records/result_json.hpp"

#include <sys/resource.h>

#include <fstream>
#include <string>

namespace gpureg::cli {

Json to_json(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  Json numbers = Json::array();
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column)
      numbers.push_back(matrix(row, column));
  return numbers;
}

Json to_json(const RegistrationStatistics& s) {
  return {{"source_points", s.source_points},
          {"target_points", s.target_points},
          {"correspondences", s.correspondences},
          {"hypotheses", s.hypotheses},
          {"survivors", s.survivors},
          {"scored", s.scored},
          {"points_scored", s.points_scored},
          {"consensus", s.consensus},
          {"inliers", s.inliers},
          {"refine_iterations", s.refine_iterations},
          {"swapped", s.swapped}};
}

Json to_json(const StageTimings& t) {
  return {{"match", t.match},   {"propose", t.propose}, {"rank", t.rank},
          {"refine", t.refine}, {"verify", t.verify},   {"total", t.total()}};
}

Json to_json(const PrepareStatistics& p) {
  return {{"input_points", p.input_points},
          {"invalid_points", p.invalid_points},
          {"points", p.points},
          {"points_without_normal", p.points_without_normal},
          {"points_without_feature", p.points_without_feature},
          {"viewpoint", to_string(p.viewpoint)},
          {"repaired_normals", p.repaired_normals},
          {"ms",
           {{"downsample", p.downsample},
            {"normals", p.normals},
            {"features", p.features},
            {"grid", p.grid},
            {"depth_maps", p.depth_maps},
            {"surface_sides", p.surface_sides},
            {"total", p.total()}}}};
}

Json to_json(const PoseEvidence& e) {
  return {{"match_inliers", e.match_inliers},
          {"match_support", e.match_support},
          {"overlap", {e.source_overlap, e.target_overlap}},
          {"overlap_any_normal", {e.source_overlap_any_normal, e.target_overlap_any_normal}},
          {"residual", {e.source_residual, e.target_residual}},
          {"normal_weighted_overlap",
           {e.source_normal_weighted_overlap, e.target_normal_weighted_overlap}},
          {"observed", {e.source_observed, e.target_observed}},
          {"free_space_violation", {e.source_free_space_violation, e.target_free_space_violation}},
          {"occluded", {e.source_occluded, e.target_occluded}},
          {"near_surface", {e.source_near_surface, e.target_near_surface}},
          {"front_violation_near", {e.source_front_violation_near, e.target_front_violation_near}},
          {"front_violation_far", {e.source_front_violation_far, e.target_front_violation_far}},
          {"behind_surface", {e.source_behind_surface, e.target_behind_surface}},
          {"information_eigenvalues", e.information_eigenvalues},
          {"weakest_direction", e.weakest_direction}};
}

Json to_json(const RegistrationMode& mode, const char* pose_name) {
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
  json["score"] = result.score;
  json["inlier_ratio"] = result.inlier_ratio;
  json["inlier_rmse"] = result.inlier_rmse;
  json[pose_name] =
      result.has_candidate ? to_json(result.target_from_source.matrix()) : Json(nullptr);
  if (!result.modes.empty()) {
    json["symmetry"] = {{"equivalent_poses", result.equivalent_poses()},
                        {"confidence", result.symmetry_confidence()}};
    json["modes"] = Json::array();
    for (const RegistrationMode& mode : result.modes)
      json["modes"].push_back(to_json(mode, pose_name));
  }
  json["statistics"] = to_json(result.statistics);
  json["ms"] = to_json(result.timings);
  return json;
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
