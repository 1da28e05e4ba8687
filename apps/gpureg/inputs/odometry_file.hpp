// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gpureg/io.hpp"
#include "gpureg/reconstruction/reconstruct.hpp"

namespace gpureg::cli {

/// Whether the first line with content has three fields, as the blocks of a Redwood log.
bool is_log(const std::string& path);

/// Known poses of scans from a file, as the odometry of a MapInput: a trajectory (TUM, whose times
/// are numbers or names of scans, or poses.txt), or the pairs of a Redwood log.
/// @param scans ascending by number.
/// @param folder for messages.
/// @throws IoError naming the file: no such file, numbers that the folder lacks, nothing in it.
reconstruction::MapInput read_odometry(const std::string& path,
                                       const std::vector<io::ScanFile>& scans,
                                       const std::string& folder);

/// Poses of scans from a trajectory (TUM, whose times are numbers or names of scans, or poses.txt);
/// no_pose() of scans that it lacks.
/// @param scans ascending by number.
/// @param folder for messages.
/// @throws IoError naming the file: no such file, times that are no numbers, fewer than two poses
/// of
///   scans.
std::vector<UnalignedIsometry3d> read_scan_poses(const std::string& path,
                                                 const std::vector<io::ScanFile>& scans,
                                                 const std::string& folder);

}  // namespace gpureg::cli
