// SPDX-License-Identifier: BSD-3-Clause
#include "trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <gpureg/error.hpp>
#include <gpureg/files.hpp>
#include <sstream>

namespace slam_demo {

Trajectory read_tum(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw gpureg::IoError(path + ": cannot be read");
  Trajectory result;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::size_t start = line.find_first_not_of(" \t\r");
    if (start == std::string::npos || line[start] == '#') continue;
    std::istringstream in(line);
    StampedPose pose;
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    if (!(in >> pose.time >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w()))
      throw gpureg::IoError(path + ":" + std::to_string(number) +
                            ": needs eight numbers: time tx ty tz qx qy qz qw");
    if (!(q.norm() > 1e-6))
      throw gpureg::IoError(path + ":" + std::to_string(number) + ": the quaternion has length 0");
    pose.world_from_camera.linear() = q.normalized().toRotationMatrix();
    pose.world_from_camera.translation() = t;
    result.push_back(pose);
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.time < b.time; });
  return result;
}

void write_tum(const std::string& path, const Trajectory& trajectory) {
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  char line[256];
  for (const StampedPose& pose : trajectory) {
    const Eigen::Vector3d t = pose.world_from_camera.translation();
    Eigen::Quaterniond q(pose.world_from_camera.linear());
    q.normalize();
    if (q.w() < 0) q.coeffs() *= -1;
    std::snprintf(line, sizeof(line), "%.6f %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n", pose.time, t.x(),
                  t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
    text += line;
  }
  gpureg::files::write_atomically(path, text);
}

AteResult absolute_error(const Trajectory& truth, const Trajectory& estimate,
                         double max_difference) {
  AteResult result;
  std::vector<Eigen::Vector3d> from, to;
  for (const StampedPose& pose : estimate) {
    auto after = std::lower_bound(
        truth.begin(), truth.end(), pose.time,
        [](const StampedPose& candidate, double time) { return candidate.time < time; });
    if (after != truth.begin() &&
        (after == truth.end() || pose.time - std::prev(after)->time < after->time - pose.time))
      --after;
    if (after == truth.end() || std::abs(after->time - pose.time) > max_difference) continue;
    from.push_back(pose.world_from_camera.translation());
    to.push_back(after->world_from_camera.translation());
    result.times.push_back(pose.time);
  }
  result.poses = from.size();
  if (from.size() < 3) {
    result.times.clear();
    return result;
  }
  const auto columns = static_cast<Eigen::Index>(from.size());
  const Eigen::Map<const Eigen::Matrix3Xd> a(from.front().data(), 3, columns),
      b(to.front().data(), 3, columns);
  result.truth_from_estimate.matrix() = Eigen::umeyama(a, b, false);
  double squared = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const double error = (result.truth_from_estimate * from[i] - to[i]).norm();
    result.errors.push_back(error);
    squared += error * error;
    result.mean += error;
    result.max = std::max(result.max, error);
  }
  result.mean /= static_cast<double>(from.size());
  result.rmse = std::sqrt(squared / static_cast<double>(from.size()));
  std::vector<double> sorted = result.errors;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t half = sorted.size() / 2;
  result.median = sorted.size() % 2 == 1 ? sorted[half] : 0.5 * (sorted[half - 1] + sorted[half]);
  return result;
}

}  // namespace slam_demo
