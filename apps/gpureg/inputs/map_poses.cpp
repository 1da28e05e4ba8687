// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/map_poses.hpp"

#include <algorithm>
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

using Poses = std::map<std::int64_t, UnalignedIsometry3d>;

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

Poses of_graph(const std::string& path) {
  Poses poses;
  for (const pose_graph::Node& node : pose_graph::read_g2o(path).nodes)
    if (node.world_from_node) poses[node.id] = *node.world_from_node;
  return poses;
}

/// Entries i i are poses of scans, as Choi et al. write trajectories; others are pairs.
Poses of_log(const std::string& path) {
  const std::vector<evaluation::LogEntry> log = evaluation::read_log(path);
  Poses poses;
  for (const evaluation::LogEntry& entry : log)
    if (entry.i == entry.j) poses[entry.i].matrix() = entry.transform;
  if (!poses.empty() || log.empty()) return poses;
  std::map<std::int64_t, std::vector<const evaluation::LogEntry*>> entries_of;
  for (const evaluation::LogEntry& entry : log)
    for (const std::int64_t scan : {entry.i, entry.j}) entries_of[scan].push_back(&entry);
  poses[log.front().i] = UnalignedIsometry3d::Identity();
  for (std::vector<std::int64_t> waiting = {log.front().i}, next; !waiting.empty();
       waiting = std::exchange(next, {}))
    for (const std::int64_t scan : waiting)
      for (const evaluation::LogEntry* entry : entries_of[scan]) {
        UnalignedIsometry3d i_from_j;
        i_from_j.matrix() = entry->transform;
        const std::int64_t other = entry->i == scan ? entry->j : entry->i;
        if (poses.count(other)) continue;
        poses[other] = poses[scan] * (entry->i == scan ? i_from_j : i_from_j.inverse());
        next.push_back(other);
      }
  return poses;
}

}  // namespace

std::vector<UnalignedIsometry3d> read_map_poses(const std::string& path,
                                                const std::vector<int>& numbers,
                                                const std::string& folder) {
  const std::vector<std::string> first = first_line(path);
  const std::string& tag = first.front();
  const bool graph = tag.rfind("VERTEX", 0) == 0 || tag.rfind("EDGE", 0) == 0 || tag == "FIX";
  if (!graph && first.size() != 3) return read_scan_poses(path, numbers, folder);
  const Poses poses = graph ? of_graph(path) : of_log(path);
  std::vector<UnalignedIsometry3d> out(numbers.size(), no_pose());
  std::size_t known = 0;
  for (std::size_t k = 0; k < numbers.size(); ++k)
    if (const auto at = poses.find(numbers[k]); at != poses.end()) {
      out[k] = at->second;
      ++known;
    }
  if (known < 2) throw IoError(path + ": holds no poses of two fragments of " + folder);
  return out;
}

}  // namespace gpureg::cli
