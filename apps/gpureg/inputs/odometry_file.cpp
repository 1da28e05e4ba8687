// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/odometry_file.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>
#include <string_view>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/evaluation/trajectory.hpp"

namespace gpureg::cli {

bool is_log(const std::string& path) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream fields(line.substr(0, line.find('#')));
    int count = 0, numbers = 0;
    for (std::string field; fields >> field; ++count)
      numbers += field.front() >= '0' && field.front() <= '9';
    if (count > 0) return count == 3 && numbers > 0;
  }
  return false;
}

namespace {

using Scans = std::vector<io::ScanFile>;

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw IoError(path + ": " + why);
}

std::optional<std::size_t> place_of(const Scans& scans, int number) {
  const auto at =
      std::lower_bound(scans.begin(), scans.end(), number,
                       [](const io::ScanFile& scan, int value) { return scan.number < value; });
  if (at == scans.end() || at->number != number) return {};
  return static_cast<std::size_t>(at - scans.begin());
}

std::vector<reconstruction::Odometry> from_log(const std::string& path, const Scans& scans,
                                               const std::string& folder) {
  const auto scan_of = [&](int number) {
    const auto place = place_of(scans, number);
    if (!place)
      fail(path, "names fragment " + std::to_string(number) + ", which " + folder + " lacks");
    return static_cast<std::uint32_t>(*place);
  };
  std::vector<reconstruction::Odometry> odometry;
  for (const evaluation::LogEntry& entry : evaluation::read_log(path)) {
    if (entry.i == entry.j)
      fail(path + ":" + std::to_string(entry.line),
           "is fragment " + std::to_string(entry.i) +
               " with itself, expected relative poses of two fragments");
    reconstruction::Odometry edge;
    edge.source = scan_of(entry.j);
    edge.target = scan_of(entry.i);
    edge.target_from_source.matrix() = entry.transform;
    odometry.push_back(edge);
  }
  return odometry;
}

/// Times of names are the scans' numbers. Who names scans by their times, 1305031102.175304.ply,
/// has poses of other times too.
class Names {
 public:
  explicit Names(const Scans& scans) : scans_(scans) {}

  std::optional<double> time_of(std::string_view word) {
    constexpr std::size_t kDigits = 9;  // longer numbers are times
    if (word.size() <= kDigits && word.find_first_not_of("0123456789") == std::string_view::npos)
      return {};
    if (const auto k = io::find_scan(scans_, word)) {
      found_ = true;
      return scans_[*k].number;
    }
    if (word.find_first_not_of("+-.0123456789eE \t") == std::string_view::npos) return {};
    // The poses of a longer run serve some of its scans.
    return std::numeric_limits<double>::quiet_NaN();
  }

  bool found() const { return found_; }

 private:
  const Scans& scans_;
  bool found_ = false;
};

std::vector<UnalignedIsometry3d> poses_of(const std::string& path, const Scans& scans) {
  std::vector<UnalignedIsometry3d> world_from_scan(scans.size(), no_pose());
  Names names(scans);
  for (const evaluation::StampedPose& pose :
       evaluation::read_trajectory(path, evaluation::TrajectoryFormat::automatic,
                                   [&](std::string_view word) { return names.time_of(word); })) {
    constexpr double kMost = 2147483647;
    if (!(pose.time >= 0 && pose.time <= kMost && pose.time == std::floor(pose.time))) {
      if (names.found()) continue;
      fail(path, "has the time " + std::to_string(pose.time) +
                     ", expected the number of a fragment or the name of a scan");
    }
    const auto number = static_cast<int>(pose.time);
    // The odometry of a longer run serves a folder with some of its scans.
    if (const auto place = place_of(scans, number))
      world_from_scan[*place].matrix() = pose.world_from_body;
  }
  return world_from_scan;
}

}  // namespace

reconstruction::MapInput read_odometry(const std::string& path,
                                       const std::vector<io::ScanFile>& scans,
                                       const std::string& folder) {
  reconstruction::MapInput known;
  if (is_log(path))
    known.odometry = from_log(path, scans, folder);
  else
    known.world_from_scan = poses_of(path, scans);
  if (known.odometry.empty() && reconstruction::odometry_of_poses(known.world_from_scan).empty())
    fail(path, "holds no pose of two scans of " + folder);
  return known;
}

std::vector<UnalignedIsometry3d> read_scan_poses(const std::string& path,
                                                 const std::vector<io::ScanFile>& scans,
                                                 const std::string& folder) {
  std::vector<UnalignedIsometry3d> poses = poses_of(path, scans);
  const auto known = std::count_if(poses.begin(), poses.end(), [](const UnalignedIsometry3d& p) {
    return p.matrix().allFinite();
  });
  if (known < 2) fail(path, "holds no poses of two fragments of " + folder);
  return poses;
}

}  // namespace gpureg::cli
