// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/map_input.hpp"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <iterator>

#include "gpureg/error.hpp"
#include "inputs/cloud_file.hpp"
#include "inputs/odometry_file.hpp"
#include "inputs/saved_map.hpp"
#include "inputs/scene.hpp"
#include "run/progress.hpp"

namespace gpureg::cli {
namespace {

namespace fs = std::filesystem;
using localization::MapBuilder;
using localization::PreparedMap;

/// Scans of one frame.
struct PosedScans {
  FragmentFolder folder;
  std::vector<UnalignedIsometry3d> poses;  ///< no_pose(): of another frame, or not known
};

/// The largest island.
PosedScans of_reconstruction(const std::string& path, const std::string& file) {
  const SavedMap map = read_saved_map(file);
  if (!map.scans.exists())
    throw IoError(file + " names the scans of " + map.scans.path + ", which is not there");
  if (map.islands.size() > 1)
    std::cerr << "gpureg: note: " << path << " has " << map.islands.size()
              << " islands, the map is the largest one" << std::endl;
  PosedScans out{FragmentFolder(map.scans, false), {}};
  out.poses.assign(out.folder.numbers.size(), no_pose());
  const std::vector<int>& largest = map.islands.front();
  for (std::size_t k = 0; k < out.folder.scans.size(); ++k)
    if (const auto number = map.number_of(out.folder.scans[k]);
        number && std::find(largest.begin(), largest.end(), *number) != largest.end())
      out.poses[k] = map.poses.at(*number);
  return out;
}

constexpr const char* kPoseFiles[] = {"poses.txt", "trajectory.txt"};

PosedScans posed_scans(const ScanInput& input) {
  const std::string& path = input.path;
  if (const std::string file = saved_map_file(path); !file.empty())
    return of_reconstruction(path, file);
  for (const char* name : kPoseFiles) {
    const fs::path file = fs::path(input.folder()) / name;
    if (!fs::exists(file)) continue;
    PosedScans out;
    try {
      out.folder = FragmentFolder(input, false);
    } catch (const IoError& error) {
      throw IoError(std::string(error.what()) + "; nor a reconstruction.json" + kWrittenLast);
    }
    out.poses = read_scan_poses(file.string(), out.folder.scans, path);
    return out;
  }
  throw IoError(path +
                " has neither poses.txt nor trajectory.txt with the poses of its scans, nor " +
                "a reconstruction.json" + kWrittenLast);
}

PreparedMap map_of_scans(const Context& context, const ScanInput& input,
                         const localization::MapOptions& options) {
  const auto [folder, poses] = posed_scans(input);
  MapBuilder builder(options);
  Progress progress("mapping", "scans", folder.numbers.size(), false);
  for (std::size_t k = 0; k < folder.numbers.size(); ++k) {
    if (!poses[k].matrix().allFinite()) continue;
    const PointCloud cloud = folder.read(k, mesh_spacing(options.voxel_size), MeshNote::none);
    try {
      builder.add_scan(context, cloud.view(), poses[k]);
    } catch (const InvalidArgument& error) {
      throw InvalidArgument(folder.scans[k].path + ": " + error.what());
    }
    progress.update(k + 1);
  }
  return builder.build();
}

}  // namespace

bool has_poses(const ScanInput& input) {
  std::error_code ignored;
  const fs::path folder = input.folder();
  return !saved_map_file(input.path).empty() ||
         std::any_of(std::begin(kPoseFiles), std::end(kPoseFiles),
                     [&](const char* name) { return fs::exists(folder / name, ignored); });
}

MapInput::MapInput(std::string of, bool with_subfolders)
    : path(std::move(of)), recursive(with_subfolders) {
  if (io::names_scans(path)) {
    kind = Kind::scans;
  } else if (PreparedMap::is_saved(path)) {
    kind = Kind::saved;
    saved = PreparedMap::load(path);
  }
}

std::vector<PointCloud> MapInput::sample() const {
  std::vector<PointCloud> clouds;
  if (kind == Kind::saved) clouds.push_back(saved->cloud());
  if (kind == Kind::cloud) clouds.push_back(read_cloud(path, 0, MeshNote::none));
  if (kind != Kind::scans) return clouds;
  constexpr std::size_t kMost = 8;
  const auto [folder, poses] = posed_scans({path, recursive});
  const std::size_t count = std::min(folder.numbers.size(), kMost);
  for (std::size_t k = 0; k < count; ++k)
    clouds.push_back(folder.read(k * folder.numbers.size() / count, 0, MeshNote::none));
  return clouds;
}

PreparedMap MapInput::prepare(const Context& context,
                              const localization::MapOptions& options) const {
  if (saved) return *saved;
  try {
    if (kind == Kind::scans) return map_of_scans(context, {path, recursive}, options);
    const PointCloud cloud = read_cloud(path, mesh_spacing(options.voxel_size), MeshNote::print);
    return localization::prepare_map(cloud.view(), options);
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(path + ": " + error.what());
  }
}

PointCloud read_scan(const std::string& path, const Context& context,
                     const localization::MapOptions& options) {
  if (!io::names_scans(path))
    return read_cloud(path, mesh_spacing(options.voxel_size), MeshNote::print);
  return MapInput(path).prepare(context, options).cloud();
}

}  // namespace gpureg::cli
