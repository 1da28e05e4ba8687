// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "map_run.hpp"

namespace gpureg::cli {

/// Relative poses of scans from a file. A trajectory (TUM, whose times are numbers of fragments, or
/// poses.txt) gives those of consecutive scans of the folder; a Redwood log gives its pairs.
/// @throws IoError naming the file: no such file, numbers that the folder lacks, nothing in it.
std::vector<reconstruction::Odometry> read_odometry(const std::string& path, const MapRun& run);

}  // namespace gpureg::cli
