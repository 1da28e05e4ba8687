// SPDX-License-Identifier: BSD-3-Clause
#include "records/map_files.hpp"

#include <charconv>
#include <vector>

#include "gpureg/evaluation.hpp"
#include "gpureg/evaluation/trajectory.hpp"
#include "gpureg/files.hpp"
#include "gpureg/io.hpp"
#include "inputs/cloud_file.hpp"
#include "run/progress.hpp"

namespace gpureg::cli {
namespace {

void append(std::string& text, double value) {
  char buffer[40];
  text.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

std::string poses_text(const MapRun& run) {
  std::string text;
  for (std::size_t k = 0; k < run.map.scans.size(); ++k) {
    if (!run.map.scans[k].placed) continue;
    text += std::to_string(run.scene.numbers[k]) + "\n";
    const Eigen::Matrix4d pose = run.map.scans[k].island_from_scan.matrix();
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) {
        append(text, pose(row, column));
        text += column < 3 ? ' ' : '\n';
      }
  }
  return text;
}

/// The number stands for the time.
evaluation::Trajectory trajectory_of(const MapRun& run) {
  evaluation::Trajectory result;
  for (std::size_t k = 0; k < run.map.scans.size(); ++k)
    if (run.map.scans[k].placed)
      result.push_back(
          {static_cast<double>(run.scene.numbers[k]), run.map.scans[k].island_from_scan.matrix()});
  return result;
}

/// Accepted edges with the poses of the map.
void write_edges(const MapRun& run) {
  std::vector<evaluation::LogEntry> log;
  for (const reconstruction::Edge& edge : run.map.edges)
    if (edge.accepted && run.map.scans[edge.source].placed)
      log.push_back({run.scene.numbers[edge.target], run.scene.numbers[edge.source],
                     run.scene.count(),
                     (run.map.scans[edge.target].island_from_scan.inverse() *
                      run.map.scans[edge.source].island_from_scan)
                         .matrix()});
  evaluation::write_log(run.file("edges.log"), log);
}

}  // namespace

void write_poses(const MapRun& run) {
  files::write_atomically(run.file("poses.txt"), poses_text(run));
  evaluation::write_trajectory(run.file("trajectory.txt"), trajectory_of(run));
  write_edges(run);
  const std::vector<std::int64_t> ids(run.scene.numbers.begin(), run.scene.numbers.end());
  pose_graph::write_g2o(run.file("graph.g2o"), reconstruction::graph_of(run.map, ids));
}

std::string map_name(std::size_t island) {
  return island == 0 ? "map.ply" : "map_" + std::to_string(island) + ".ply";
}

/// One map per island, one scan in memory at a time.
void write_merged_maps(MapRun& run, float voxel_size, bool quiet) {
  Progress progress("merging", "scans", run.map.placed(), quiet);
  std::size_t merged = 0;
  for (std::size_t k = 0; k < run.map.islands.size(); ++k) {
    reconstruction::VoxelMap map(voxel_size);
    for (const std::uint32_t scan : run.map.islands[k].scans) {
      const PointCloud cloud =
          read_cloud(run.scene.files[scan], mesh_spacing(voxel_size), MeshNote::none);
      map.add(cloud.view(), run.map.scans[scan].island_from_scan);
      progress.update(++merged);
    }
    run.map_points += map.size();
    io::write_point_cloud(run.file(map_name(k)), map.cloud());
  }
}

}  // namespace gpureg::cli
