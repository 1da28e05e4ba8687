// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "data/generate.hpp"
#include "support/temporary_folder.hpp"

/// Readers of the generator's files, independent of the code that writes them.
namespace gpureg::test {

inline synthetic::GenerateOptions small_scene(std::uint64_t seed = 1) {
  synthetic::GenerateOptions options;
  options.fragments = 3;
  options.frames_per_fragment = 6;
  options.seed = seed;
  options.threads = 2;
  return options;
}

inline std::vector<Eigen::Vector3f> read_cloud(const std::string& path) {
  const std::string bytes = content_of(path);
  const std::string mark = "end_header\n";
  const std::size_t body = bytes.find(mark) + mark.size();
  const std::size_t count = std::stoul(bytes.substr(bytes.find("vertex ") + 7));
  if (bytes.size() != body + 12 * count) throw std::runtime_error(path + ": wrong size");
  std::vector<Eigen::Vector3f> points(count);
  std::memcpy(static_cast<void*>(points.data()), bytes.data() + body,
              12 * count);  // tests run on little-endian machines
  return points;
}

inline std::vector<Eigen::Isometry3d> read_poses(const std::string& path) {
  std::ifstream file(path);
  std::vector<Eigen::Isometry3d> poses;
  for (std::size_t number; file >> number;) {
    Eigen::Isometry3d pose;
    for (int k = 0; k < 16; ++k) file >> pose.matrix()(k / 4, k % 4);
    if (number != poses.size() || !file)
      throw std::runtime_error(path + ": wrong order or truncated");
    poses.push_back(pose);
  }
  return poses;
}

/// Every file below a folder, by relative path.
inline std::map<std::string, std::string> all_files(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    files[std::filesystem::relative(entry.path(), folder).string()] =
        content_of(entry.path().string());
  }
  return files;
}

}  // namespace gpureg::test
