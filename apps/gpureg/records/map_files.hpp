// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "records/map_run.hpp"

namespace gpureg::cli {

/// The files of a map, but for those of further islands.
inline constexpr const char* kMapFiles[] = {"poses.txt", "trajectory.txt", "edges.log",
                                            "graph.g2o", "map.ply",        "map.html",
                                            "scans.csv", "pairs.json",     "reconstruction.json"};

/// Name of the file of an island, which has a frame of its own: map.ply, map_1.ply, ...
std::string file_of_island(const std::string& name, std::size_t island);

/// Paths of all files in a folder that have the names of a map's.
std::vector<std::string> map_files_in(const std::string& folder);

/// poses.txt, trajectory.txt and graph.g2o of each island, edges.log, and scans.csv, which says
/// what the numbers in these are. Throws IoError.
void write_poses(const MapRun& run);

/// The map of each island, one scan in memory at a time; counts the points. Throws IoError.
/// @return false: interrupted.
bool write_merged_maps(MapRun& run, float voxel_size, bool quiet);

}  // namespace gpureg::cli
