// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/initial_poses.hpp"

#include <algorithm>
#include <numeric>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/evaluation/trajectory.hpp"
#include "inputs/odometry_file.hpp"

namespace gpureg::cli {
std::vector<UnalignedIsometry3d> read_initial_poses(const std::string& path) {
  std::vector<Eigen::Matrix4d> matrices;
  if (is_log(path)) {
    for (const evaluation::LogEntry& entry : evaluation::read_log(path))
      matrices.push_back(entry.transform);
  } else {
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

RegistrationResult result_of(const std::vector<PoseVerification>& poses, double min_confidence) {
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
  result.has_candidate = true;
  result.target_from_source = best.target_from_source;
  result.score = best.confidence;
  result.statistics.inliers = best.inliers;
  result.statistics.points_scored = best.points;
  result.inlier_ratio = best.inlier_ratio;
  result.inlier_rmse = best.inlier_rmse;
  result.source_moments = best.source_moments;
  result.target_moments = best.target_moments;
  result.reason = result.score >= min_confidence ? RegistrationReason::none
                                                 : RegistrationReason::confidence_too_low;
  result.status = result.reason == RegistrationReason::none ? RegistrationStatus::aligned
                                                            : RegistrationStatus::not_aligned;
  return result;
}

}  // namespace gpureg::cli
