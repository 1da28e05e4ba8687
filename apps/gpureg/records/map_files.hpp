// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "run/map_run.hpp"

namespace gpureg::cli {

/// poses.txt, trajectory.txt, edges.log and graph.g2o. Throws IoError.
void write_poses(const MapRun& run);

/// Name of an island's map: map.ply, map_1.ply, ...
std::string map_name(std::size_t island);

/// The map of each island, one scan in memory at a time; counts the points. Throws IoError.
void write_merged_maps(MapRun& run, float voxel_size, bool quiet);

}  // namespace gpureg::cli
