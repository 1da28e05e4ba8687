// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/map_poses.hpp"

#include <fstream>
#include <map>
#include <sstream>
#include <utility>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/pose_graph/files.hpp"
#include "inputs/odometry_file.hpp"

namespace gpureg::cli {
namespace {

/// Fields of the first line with content.
std::vector<std::string> first_line(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw IoError("cannot read " + path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream fields(line.substr(0, line.find('#')));
    std::vector<std::string> words;
    for (std::string word; fields >> word;) words.push_back(word);
    if (!words.empty()) return words;
  }
  throw IoError(path + ": holds no pose");
}

PosesByNumber of_graph(const std::string& path) {
  PosesByNumber poses;
  for (const pose_graph::Node& node : pose_graph::read_g2o(path).nodes)
    if (node.world_from_node) poses[node.id] = *node.world_from_node;
  return poses;
}

/// Entries i i are poses of scans, as Choi et al. write trajectories; others are pairs: scans that
/// they connect are an island.
PosesByNumber of_log(const std::string& path, std::map<std::int64_t, std::uint32_t>& island) {
  const std::vector<evaluation::LogEntry> log = evaluation::read_log(path);
  PosesByNumber poses;
  for (const evaluation::LogEntry& entry : log)
    if (entry.i == entry.j) poses[entry.i].matrix() = entry.transform;
  if (!poses.empty()) return poses;
  std::map<std::int64_t, std::vector<const evaluation::LogEntry*>> entries_of;
  for (const evaluation::LogEntry& entry : log)
    for (const std::int64_t scan : {entry.i, entry.j}) entries_of[scan].push_back(&entry);
  std::uint32_t islands = 0;
  for (const evaluation::LogEntry& first : log) {
    if (poses.count(first.i)) continue;
    poses[first.i] = UnalignedIsometry3d::Identity();
    for (std::vector<std::int64_t> waiting = {first.i}, next; !waiting.empty();
         waiting = std::exchange(next, {}))
      for (const std::int64_t scan : waiting) {
        island[scan] = islands;
        for (const evaluation::LogEntry* entry : entries_of[scan]) {
          UnalignedIsometry3d i_from_j;
          i_from_j.matrix() = entry->transform;
          const std::int64_t other = entry->i == scan ? entry->j : entry->i;
          if (poses.count(other)) continue;
          poses[other] = poses[scan] * (entry->i == scan ? i_from_j : i_from_j.inverse());
          next.push_back(other);
        }
      }
    ++islands;
  }
  return poses;
}

}  // namespace

reconstruction::Reconstruction map_of(const PosesByNumber& poses,
                                      const std::map<std::int64_t, std::uint32_t>& island,
                                      const std::vector<io::ScanFile>& scans,
                                      const std::string& path, const std::string& folder) {
  std::vector<UnalignedIsometry3d> known(scans.size(), no_pose());
  std::vector<std::uint32_t> islands(scans.size(), 0);
  std::map<std::uint32_t, std::uint32_t> counted;  // those without a fragment here do not count
  std::size_t count = 0;
  for (std::size_t k = 0; k < scans.size(); ++k) {
    const auto pose = poses.find(scans[k].number);
    if (pose == poses.end()) continue;
    known[k] = pose->second;
    ++count;
    const auto at = island.find(scans[k].number);
    if (at != island.end())
      islands[k] =
          counted.insert({at->second, static_cast<std::uint32_t>(counted.size())}).first->second;
  }
  if (count < 2) throw IoError(path + ": holds no poses of two fragments of " + folder);
  return reconstruction::map_of_poses(known, islands);
}

reconstruction::Reconstruction read_pose_file(const std::string& path,
                                              const std::vector<io::ScanFile>& scans,
                                              const std::string& folder) {
  const std::vector<std::string> first = first_line(path);
  const std::string& tag = first.front();
  const bool graph = tag.rfind("VERTEX", 0) == 0 || tag.rfind("EDGE", 0) == 0 || tag == "FIX";
  if (!graph && !is_log(path))
    return reconstruction::map_of_poses(read_scan_poses(path, scans, folder));
  std::map<std::int64_t, std::uint32_t> island;
  const PosesByNumber poses = graph ? of_graph(path) : of_log(path, island);
  return map_of(poses, island, scans, path, folder);
}

}  // namespace gpureg::cli
