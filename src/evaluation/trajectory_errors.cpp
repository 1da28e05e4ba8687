// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "evaluation/statistics.hpp"
#include "gpureg/error.hpp"
#include "gpureg/evaluation/trajectory.hpp"
#include "math/trigonometry.hpp"

namespace gpureg::evaluation {
namespace {

struct Match {
  Eigen::Isometry3d estimate, truth;
  double time;  // of the estimate
};

Eigen::Isometry3d isometry(const StampedPose& pose) {
  Eigen::Isometry3d out;
  out.matrix() = pose.world_from_body;
  return out;
}

/// Place of the pose with the nearest time; of two equally near ones, the earlier.
std::size_t nearest(const Trajectory& truth, double time) {
  const auto at =
      std::lower_bound(truth.begin(), truth.end(), time,
                       [](const StampedPose& pose, double value) { return pose.time < value; });
  auto best = at == truth.end() ? at - 1 : at;
  if (at != truth.begin() && time - (at - 1)->time <= std::abs(best->time - time)) best = at - 1;
  return static_cast<std::size_t>(best - truth.begin());
}

std::vector<Match> matches_of(const Trajectory& estimate, const Trajectory& truth,
                              double max_difference) {
  // Times of 1e9 seconds are doubles 1e-7 apart.
  constexpr double kRounding = 1e-6;
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::vector<std::size_t> by_truth(truth.size(), kNone);
  for (std::size_t k = 0; k < estimate.size() && !truth.empty(); ++k) {
    const std::size_t found = nearest(truth, estimate[k].time);
    const double difference = std::abs(truth[found].time - estimate[k].time);
    if (difference > max_difference + kRounding * (max_difference > 0)) continue;
    std::size_t& taken = by_truth[found];
    if (taken == kNone || difference < std::abs(truth[found].time - estimate[taken].time))
      taken = k;
  }
  std::vector<Match> matches;
  for (std::size_t k = 0; k < truth.size(); ++k)
    if (by_truth[k] != kNone)
      matches.push_back(
          {isometry(estimate[by_truth[k]]), isometry(truth[k]), estimate[by_truth[k]].time});
  return matches;
}

/// Rigid motion without scale that moves the estimated positions onto the true ones.
Eigen::Isometry3d alignment(const std::vector<Match>& matches) {
  const auto size = static_cast<Eigen::Index>(matches.size());
  Eigen::Matrix3Xd from(3, size), to(3, size);
  for (Eigen::Index k = 0; k < size; ++k) {
    from.col(k) = matches[static_cast<std::size_t>(k)].estimate.translation();
    to.col(k) = matches[static_cast<std::size_t>(k)].truth.translation();
  }
  Eigen::Isometry3d out;
  out.matrix() = Eigen::umeyama(from, to, false);
  return out;
}

double degrees_of(const Eigen::Isometry3d& error) {
  const Eigen::Quaterniond q(error.linear());
  return 2 * portable::atan2(q.vec().norm(), std::abs(q.w())) / portable::kRadiansPerDegree;
}

/// Index pairs of the relative error.
std::vector<std::pair<std::size_t, std::size_t>> steps_of(const std::vector<Match>& matches,
                                                          const TrajectoryOptions& options) {
  std::vector<std::pair<std::size_t, std::size_t>> steps;
  if (options.delta_unit == DeltaUnit::frames) {
    const auto delta = static_cast<std::size_t>(options.delta);
    for (std::size_t k = 0; k + delta < matches.size(); ++k) steps.emplace_back(k, k + delta);
    return steps;
  }
  double length = 0;
  std::size_t first = 0;
  for (std::size_t k = 1; k < matches.size(); ++k) {
    length += (matches[k].truth.translation() - matches[k - 1].truth.translation()).norm();
    if (length < options.delta) continue;
    steps.emplace_back(first, k);
    first = k;
    length = 0;
  }
  return steps;
}

}  // namespace

void TrajectoryOptions::validate() const {
  const auto fail = [](const std::string& what) { throw InvalidArgument(what); };
  if (!(max_difference >= 0))
    fail("max_difference is " + std::to_string(max_difference) + ", expected 0 or more");
  if (!(std::isfinite(delta) && delta > 0))
    fail("delta is " + std::to_string(delta) + ", expected a finite number > 0");
  if (delta_unit == DeltaUnit::frames && (delta != std::floor(delta) || delta > 1e9))
    fail("delta is " + std::to_string(delta) + ", expected a whole number of frames");
}

TrajectoryEvaluation evaluate_trajectory(const Trajectory& estimate, const Trajectory& truth,
                                         const TrajectoryOptions& options) {
  options.validate();
  std::vector<Match> matches = matches_of(estimate, truth, options.max_difference);
  const std::size_t needed = options.align ? 3 : 2;
  if (matches.size() < needed)
    throw InvalidArgument(std::to_string(matches.size()) + " of " +
                          std::to_string(estimate.size()) + " poses have a true pose within " +
                          std::to_string(options.max_difference) + " of their time, expected " +
                          std::to_string(needed) + " or more");
  TrajectoryEvaluation out;
  out.estimated = estimate.size();
  out.true_poses = truth.size();
  out.matched = matches.size();
  if (options.align) {
    const Eigen::Isometry3d truth_from_estimate = alignment(matches);
    for (Match& match : matches) match.estimate = truth_from_estimate * match.estimate;
    out.truth_from_estimate = truth_from_estimate.matrix();
  }
  std::vector<double> metres, degrees;
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const Eigen::Isometry3d &estimated = matches[k].estimate, &true_pose = matches[k].truth;
    if (k > 0)
      out.path_length += (true_pose.translation() - matches[k - 1].truth.translation()).norm();
    metres.push_back((estimated.translation() - true_pose.translation()).norm());
    degrees.push_back(degrees_of(true_pose.inverse() * estimated));
    out.poses.push_back({matches[k].time, metres.back(), degrees.back()});
  }
  out.absolute_translation = statistics_of(std::move(metres));
  out.absolute_rotation = statistics_of(std::move(degrees));
  metres.clear();
  degrees.clear();
  for (const auto& [from, to] : steps_of(matches, options)) {
    const Eigen::Isometry3d true_step = matches[from].truth.inverse() * matches[to].truth,
                            step = matches[from].estimate.inverse() * matches[to].estimate,
                            error = true_step.inverse() * step;
    metres.push_back(error.translation().norm());
    degrees.push_back(degrees_of(error));
  }
  out.relative_translation = statistics_of(std::move(metres));
  out.relative_rotation = statistics_of(std::move(degrees));
  return out;
}

}  // namespace gpureg::evaluation
