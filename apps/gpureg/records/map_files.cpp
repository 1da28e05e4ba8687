// SPDX-License-Identifier: BSD-3-Clause
#include "records/map_files.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iterator>
#include <vector>

#include "gpureg/evaluation.hpp"
#include "gpureg/evaluation/trajectory.hpp"
#include "gpureg/files.hpp"
#include "gpureg/io.hpp"
#include "inputs/cloud_file.hpp"
#include "options/scale_option.hpp"
#include "records/scan_table.hpp"
#include "run/interrupt.hpp"
#include "run/progress.hpp"

namespace gpureg::cli {
namespace {

namespace fs = std::filesystem;

/// Those with one file for each island.
constexpr const char* kOfIslands[] = {"poses.txt", "trajectory.txt", "graph.g2o", "map.ply"};

/// Whether a file is that of an island but the largest: poses_1.txt, ...
bool is_of_island(const std::string& name) {
  return std::any_of(std::begin(kOfIslands), std::end(kOfIslands), [&](const char* of) {
    const std::string stem = fs::path(of).stem().string() + "_";
    const fs::path file(name);
    const std::string rest = file.stem().string();
    if (file.extension() != fs::path(of).extension() || rest.rfind(stem, 0) != 0) return false;
    const std::string number = rest.substr(stem.size());
    return !number.empty() && number.front() != '0' &&
           number.find_first_not_of("0123456789") == std::string::npos;
  });
}

void append(std::string& text, double value) {
  char buffer[40];
  text.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

std::string poses_text(const MapRun& run, const reconstruction::Island& island) {
  std::string text;
  for (const std::uint32_t k : island.scans) {
    text += std::to_string(run.scene.numbers[k]) + "\n";
    const Eigen::Matrix4d pose = run.island_from_scan(k);
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) {
        append(text, pose(row, column));
        text += column < 3 ? ' ' : '\n';
      }
  }
  return text;
}

/// The number stands for the time.
evaluation::Trajectory trajectory_of(const MapRun& run, const reconstruction::Island& island) {
  evaluation::Trajectory result;
  for (const std::uint32_t k : island.scans)
    result.push_back({static_cast<double>(run.scene.numbers[k]),
                      run.made.map.scans[k].island_from_scan.matrix()});
  return result;
}

/// The graph of each island.
std::vector<pose_graph::Graph> graphs_of(const MapRun& run) {
  const std::vector<std::int64_t> ids(run.scene.numbers.begin(), run.scene.numbers.end());
  pose_graph::Graph all = reconstruction::graph_of(run.made.map, ids);
  std::vector<pose_graph::Graph> out(run.made.map.islands.size());
  const auto of = [&](std::int64_t id) -> pose_graph::Graph& {
    return out[run.made.map.scans[run.scene.index_of(static_cast<int>(id))].island];
  };
  for (pose_graph::Node& node : all.nodes) of(node.id).nodes.push_back(std::move(node));
  for (pose_graph::Edge& edge : all.edges) of(edge.source).edges.push_back(std::move(edge));
  return out;
}

/// Accepted edges with the poses of the map.
void write_edges(const MapRun& run) {
  std::vector<evaluation::LogEntry> log;
  for (const reconstruction::Edge& edge : run.made.map.edges)
    if (edge.accepted && run.made.map.scans[edge.source].placed)
      log.push_back({run.scene.numbers[edge.target], run.scene.numbers[edge.source],
                     run.scene.count(),
                     run.of_files(edge.source, edge.target,
                                  run.made.map.scans[edge.target].island_from_scan.inverse() *
                                      run.made.map.scans[edge.source].island_from_scan)});
  evaluation::write_log(run.file("edges.log"), log);
}

}  // namespace

std::string file_of_island(const std::string& name, std::size_t island) {
  const fs::path path(name);
  if (island == 0) return name;
  return (path.parent_path() /
          (path.stem().string() + "_" + std::to_string(island) + path.extension().string()))
      .string();
}

std::vector<std::string> map_files_in(const std::string& folder) {
  std::vector<std::string> files;
  const auto add = [&](const fs::path& file) {
    std::error_code ignored;
    const bool there = fs::is_regular_file(file, ignored);
    if (there) files.push_back(file.string());
    return there;
  };
  for (const char* name : kMapFiles) add(fs::path(folder) / name);
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (is_of_island(entry.path().filename().string())) add(entry.path());
  return files;
}

void write_poses(const MapRun& run) {
  const std::vector<pose_graph::Graph> graphs = graphs_of(run);
  for (std::size_t k = 0; k < graphs.size(); ++k) {
    const reconstruction::Island& island = run.made.map.islands[k];
    files::write_atomically(run.file(file_of_island("poses.txt", k)), poses_text(run, island));
    evaluation::write_trajectory(run.file(file_of_island("trajectory.txt", k)),
                                 trajectory_of(run, island));
    pose_graph::write_g2o(run.file(file_of_island("graph.g2o", k)), graphs[k]);
  }
  write_edges(run);
  write_scan_table(run.file("scans.csv"), run.scene.all());
}

/// One map per island, one scan in memory at a time.
bool write_merged_maps(MapRun& run, float voxel_size, bool quiet) {
  Progress progress("merging", "scans", run.made.map.placed(), quiet);
  std::size_t merged = 0;
  for (std::size_t k = 0; k < run.made.map.islands.size(); ++k) {
    reconstruction::VoxelMap map(voxel_size);
    for (const std::uint32_t scan : run.made.map.islands[k].scans) {
      if (InterruptGuard::requested()) return false;
      const double scale = run.scale(scan);
      PointCloud cloud =
          read_cloud(run.scene.scans[scan].path, mesh_spacing(voxel_size) / scale, MeshNote::none);
      if (scale != 1) scale_cloud(cloud, scale);
      map.add(cloud.view(), run.made.map.scans[scan].island_from_scan);
      progress.update(++merged);
    }
    run.map_points += map.size();
    io::write_point_cloud(run.file(file_of_island("map.ply", k)), map.cloud());
  }
  return true;
}

}  // namespace gpureg::cli
