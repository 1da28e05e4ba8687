// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/map_input.hpp"

#include <filesystem>
#include <iostream>
#include <set>

#include "gpureg/error.hpp"
#include "inputs/cloud_file.hpp"
#include "inputs/odometry_file.hpp"
#include "inputs/scene.hpp"
#include "json/json.hpp"
#include "json/json_fields.hpp"
#include "json/json_file.hpp"
#include "run/progress.hpp"

namespace gpureg::cli {
namespace {

namespace fs = std::filesystem;
using localization::MapBuilder;
using localization::PreparedMap;

/// Scans and the file of their poses.
struct PosedScans {
  std::string folder, poses;
  std::optional<std::set<int>> numbers;  ///< those of the largest island; none: all
};

/// The folder of the scans that a reconstruction names.
std::string scans_of(const Json& json, const std::string& file) {
  std::string named;
  try {
    named = text_member(json, "folder");
  } catch (const std::exception& error) {
    throw IoError(file + ": " + error.what());
  }
  if (fs::is_directory(named)) return named;
  // It was named from where `reconstruct` ran.
  const fs::path output = fs::absolute(file).parent_path();
  const fs::path beside = output.parent_path() / fs::path(named).filename();
  if (!fs::is_directory(beside))
    throw IoError(file + " names the scans of " + named + ", which is not there");
  return beside.string();
}

PosedScans of_reconstruction(const std::string& path, const std::string& file) {
  PosedScans out;
  const Json json = DocumentFile(file).read();
  out.folder = scans_of(json, file);
  std::size_t count = 0;
  try {
    out.numbers.emplace();
    const Json& islands = member(json, "islands");
    if (islands.empty()) throw InvalidArgument("no scan was placed");
    for (const Json& number : islands.front()) out.numbers->insert(number.get<int>());
    count = islands.size();
  } catch (const std::exception& error) {
    throw IoError(file + ": " + error.what());
  }
  if (count > 1)
    std::cerr << "gpureg: note: " << path << " has " << count
              << " islands, the map is the largest one" << std::endl;
  out.poses = (fs::path(path) / "poses.txt").string();
  return out;
}

PosedScans posed_scans(const std::string& path) {
  const std::string reconstruction = (fs::path(path) / "reconstruction.json").string();
  if (fs::exists(reconstruction)) return of_reconstruction(path, reconstruction);
  for (const char* name : {"poses.txt", "trajectory.txt"})
    if (const fs::path file = fs::path(path) / name; fs::exists(file))
      return {path, file.string(), std::nullopt};
  throw IoError(path + " has neither poses.txt nor trajectory.txt with the poses of its scans");
}

PreparedMap map_of_scans(const Context& context, const std::string& path,
                         const localization::MapOptions& options) {
  const PosedScans scans = posed_scans(path);
  const FragmentFolder folder(scans.folder, false);
  const std::vector<UnalignedIsometry3d> poses =
      read_scan_poses(scans.poses, folder.numbers, scans.folder);
  MapBuilder builder(options);
  Progress progress("mapping", "scans", folder.numbers.size(), false);
  for (std::size_t k = 0; k < folder.numbers.size(); ++k) {
    if (!poses[k].matrix().allFinite()) continue;
    if (scans.numbers && scans.numbers->count(folder.numbers[k]) == 0) continue;
    const PointCloud cloud =
        folder.read(k, mesh_spacing(options.prepare.voxel_size), MeshNote::none);
    try {
      builder.add_scan(context, cloud.view(), poses[k]);
    } catch (const InvalidArgument& error) {
      throw InvalidArgument(folder.files[k] + ": " + error.what());
    }
    progress.update(k + 1);
  }
  return builder.build();
}

}  // namespace

std::string scans_of_reconstruction(const std::string& file) {
  return scans_of(DocumentFile(file).read(), file);
}

MapInput::MapInput(std::string of) : path(std::move(of)) {
  if (fs::is_directory(path)) {
    kind = Kind::scans;
  } else if (PreparedMap::is_saved(path)) {
    kind = Kind::saved;
    saved = PreparedMap::load(path);
  }
}

PreparedMap MapInput::prepare(const Context& context,
                              const localization::MapOptions& options) const {
  if (saved) return *saved;
  try {
    if (kind == Kind::scans) return map_of_scans(context, path, options);
    const PointCloud cloud =
        read_cloud(path, mesh_spacing(options.prepare.voxel_size), MeshNote::print);
    return localization::prepare_map(cloud.view(), options);
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(path + ": " + error.what());
  }
}

PointCloud read_scan(const std::string& path, const Context& context,
                     const localization::MapOptions& options) {
  if (!fs::is_directory(path))
    return read_cloud(path, mesh_spacing(options.prepare.voxel_size), MeshNote::print);
  return MapInput(path).prepare(context, options).cloud();
}

}  // namespace gpureg::cli
