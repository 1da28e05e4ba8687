// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/odometry_file.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/evaluation/trajectory.hpp"

namespace gpureg::cli {

bool is_log(const std::string& path) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream fields(line.substr(0, line.find('#')));
    int count = 0;
    for (std::string field; fields >> field;) ++count;
    if (count > 0) return count == 3;
  }
  return false;
}

namespace {

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw IoError(path + ": " + why);
}

std::vector<reconstruction::Odometry> from_log(const std::string& path,
                                               const std::vector<int>& numbers,
                                               const std::string& folder,
                                               const std::vector<int>& unusable) {
  const auto scan_of = [&](int number) {
    const auto at = std::lower_bound(numbers.begin(), numbers.end(), number);
    if (at == numbers.end() || *at != number)
      fail(path, "names fragment " + std::to_string(number) + ", which " + folder + " lacks");
    return static_cast<std::uint32_t>(at - numbers.begin());
  };
  const auto is_unusable = [&](int number) {
    return std::find(unusable.begin(), unusable.end(), number) != unusable.end();
  };
  std::vector<reconstruction::Odometry> odometry;
  for (const evaluation::LogEntry& entry : evaluation::read_log(path)) {
    if (entry.i == entry.j)
      fail(path + ":" + std::to_string(entry.line),
           "is fragment " + std::to_string(entry.i) +
               " with itself, expected relative poses of two fragments");
    if (is_unusable(entry.i) || is_unusable(entry.j)) continue;
    reconstruction::Odometry edge;
    edge.source = scan_of(entry.j);
    edge.target = scan_of(entry.i);
    edge.target_from_source.matrix() = entry.transform;
    odometry.push_back(edge);
  }
  return odometry;
}

std::vector<UnalignedIsometry3d> poses_of(const std::string& path,
                                          const std::vector<int>& numbers) {
  std::vector<UnalignedIsometry3d> world_from_scan(numbers.size(), no_pose());
  for (const evaluation::StampedPose& pose : evaluation::read_trajectory(path)) {
    constexpr double kMost = 2147483647;
    if (!(pose.time >= 0 && pose.time <= kMost && pose.time == std::floor(pose.time)))
      fail(path,
           "has the time " + std::to_string(pose.time) + ", expected the number of a fragment");
    const auto number = static_cast<int>(pose.time);
    // The odometry of a longer run serves a folder with some of its scans.
    const auto at = std::lower_bound(numbers.begin(), numbers.end(), number);
    if (at != numbers.end() && *at == number)
      world_from_scan[static_cast<std::size_t>(at - numbers.begin())].matrix() =
          pose.world_from_body;
  }
  return world_from_scan;
}

}  // namespace

std::vector<reconstruction::Odometry> read_odometry(const std::string& path,
                                                    const std::vector<int>& numbers,
                                                    const std::string& folder,
                                                    const std::vector<int>& unusable) {
  std::vector<reconstruction::Odometry> odometry =
      is_log(path) ? from_log(path, numbers, folder, unusable)
                   : reconstruction::odometry_of_poses(poses_of(path, numbers));
  if (odometry.empty()) fail(path, "holds no pose of two scans of " + folder);
  return odometry;
}

std::vector<UnalignedIsometry3d> read_scan_poses(const std::string& path,
                                                 const std::vector<int>& numbers,
                                                 const std::string& folder) {
  std::vector<UnalignedIsometry3d> poses = poses_of(path, numbers);
  const auto known = std::count_if(poses.begin(), poses.end(), [](const UnalignedIsometry3d& p) {
    return p.matrix().allFinite();
  });
  if (known < 2) fail(path, "holds no poses of two fragments of " + folder);
  return poses;
}

}  // namespace gpureg::cli
