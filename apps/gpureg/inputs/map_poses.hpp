// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gpureg/result.hpp"

namespace gpureg::cli {

/// Poses of a map from a file of any program: poses.txt, TUM with numbers of fragments as times,
/// KITTI (a line for each fragment from 0), g2o, or a Redwood log: of scans (i i n) or of pairs,
/// which are put one behind the other.
/// @param numbers of the fragments, ascending.
/// @param folder for messages.
/// @return world_from_scan of each fragment; no_pose() of those that the file lacks.
/// @throws IoError naming the file: not there, not readable, a pose that is not finite or not
/// rigid,
///   fewer than two poses of fragments.
std::vector<UnalignedIsometry3d> read_map_poses(const std::string& path,
                                                const std::vector<int>& numbers,
                                                const std::string& folder);

}  // namespace gpureg::cli
