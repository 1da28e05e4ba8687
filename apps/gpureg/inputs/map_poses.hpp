// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "gpureg/io.hpp"
#include "gpureg/reconstruction/map.hpp"

namespace gpureg::cli {

using PosesByNumber = std::map<std::int64_t, UnalignedIsometry3d>;

/// A map of any program, from a file of poses: poses.txt, TUM with numbers or names of scans as
/// times, KITTI (a line for each scan from 0), g2o, or a Redwood log: of scans (i i n) or of pairs,
/// which are put one behind the other.
/// @param scans ascending by number.
/// @param folder for messages.
/// @return one scan for each fragment, without a place where its pose is not known, and the
///   islands: of a log of pairs the scans that it connects; else one.
/// @throws IoError naming the file: not there, not readable, a pose that is not finite or not
///   rigid, fewer than two poses of fragments.
reconstruction::Reconstruction read_pose_file(const std::string& path,
                                              const std::vector<io::ScanFile>& scans,
                                              const std::string& folder);

/// The map of these scans. island: of each number; those without one are in
/// the first. Throws IoError as read_pose_file().
reconstruction::Reconstruction map_of(const PosesByNumber& poses,
                                      const std::map<std::int64_t, std::uint32_t>& island,
                                      const std::vector<io::ScanFile>& scans,
                                      const std::string& path, const std::string& folder);

}  // namespace gpureg::cli
