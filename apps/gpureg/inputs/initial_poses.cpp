// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/initial_poses.hpp"

#include <algorithm>
#include <fstream>
#include <numeric>
#include <sstream>
#include <string>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/evaluation/trajectory.hpp"
#include "inputs/odometry_file.hpp"

namespace gpureg::cli {
namespace {

/// Throws IoError for what looks like another way to write poses: angles, or quaternions.
void check_matrices(const std::string& path) {
  std::ifstream file(path);
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    std::istringstream fields(line.substr(0, line.find('#')));
    int count = 0;
    for (std::string field; fields >> field;) ++count;
    if (count == 6 || count == 7 || count == 8)
      throw IoError(path + ":" + std::to_string(number) + ": the line has " +
                    std::to_string(count) + " fields, as " +
                    (count == 6 ? "a position with three angles" : "a position with a quaternion") +
                    "; expected a 4 x 4 matrix target_from_source, row by row, or a Redwood log");
    if (count > 0) return;
  }
}

}  // namespace

std::vector<UnalignedIsometry3d> read_initial_poses(const std::string& path) {
  std::vector<Eigen::Matrix4d> matrices;
  if (is_log(path)) {
    for (const evaluation::LogEntry& entry : evaluation::read_log(path))
      matrices.push_back(entry.transform);
  } else {
    check_matrices(path);
    for (const evaluation::StampedPose& pose :
         evaluation::read_trajectory(path, evaluation::TrajectoryFormat::blocks))
      matrices.push_back(pose.world_from_body);
  }
  std::vector<UnalignedIsometry3d> poses(matrices.size());
  for (std::size_t k = 0; k < matrices.size(); ++k) poses[k].matrix() = matrices[k];
  return poses;
}

UnalignedIsometry3d read_pose(const std::string& path) {
  const std::vector<UnalignedIsometry3d> poses = read_initial_poses(path);
  if (poses.size() != 1)
    throw IoError(path + ": holds " + std::to_string(poses.size()) + " poses, expected one");
  return poses.front();
}

RegistrationResult result_of(const std::vector<PoseVerification>& poses, double min_confidence,
                             std::uint32_t source_points, std::uint32_t target_points) {
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return poses[a].confidence > poses[b].confidence;
  });
  RegistrationResult result;
  for (const std::size_t k : order) {
    RegistrationMode mode;
    mode.target_from_source = poses[k].target_from_source;
    mode.confidence = poses[k].confidence;
    mode.overlap_confidence = poses[k].overlap_confidence;
    mode.evidence = poses[k].evidence;
    mode.rank_before_refinement = static_cast<std::uint32_t>(k);
    result.modes.push_back(mode);
  }
  const PoseVerification& best = poses[order.front()];
  result.target_from_source = best.target_from_source;
  result.confidence = best.confidence;
  result.statistics.inliers = best.inliers;
  result.statistics.points_scored = best.points;
  result.inlier_ratio = best.inlier_ratio;
  result.inlier_rmse = best.inlier_rmse;
  result.source_moments = best.source_moments;
  result.target_moments = best.target_moments;
  result.statistics.source_points = source_points;
  result.statistics.target_points = target_points;
  result.reason = result.confidence >= min_confidence ? RegistrationReason::none : diagnose(result);
  result.status = result.reason == RegistrationReason::none ? RegistrationStatus::aligned
                                                            : RegistrationStatus::not_aligned;
  return result;
}

}  // namespace gpureg::cli
