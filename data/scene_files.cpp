// SPDX-License-Identifier: BSD-3-Clause
#include "data/scene_files.hpp"

#include <cstdio>
#include <cstring>
#include <filesystem>

#include "gpureg/error.hpp"
#include "gpureg/files.hpp"

namespace gpureg::synthetic {
namespace {

namespace fs = std::filesystem;

void make_folder(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path, error)) {
    throw IoError(path.string() + ": cannot make this folder" +
                  (error ? ": " + error.message() : std::string()));
  }
}

/// The number k of a file `cloud_bin_<k>.ply` or .pcd, else -1.
long cloud_number(const std::string& name) {
  long number = -1;
  char extension[4] = "";
  int used = 0;
  if (std::sscanf(name.c_str(), "cloud_bin_%ld.%3s%n", &number, extension, &used) != 2) return -1;
  return static_cast<std::size_t>(used) == name.size() ? number : -1;
}

/// Little endian whatever the machine is.
void append(std::string& bytes, float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof(bits));
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>((bits >> shift) & 0xFFu);
}

}  // namespace

void open_folder(const std::string& folder, int fragments, bool rgbd) {
  if (folder.empty()) throw IoError("the output folder has no name");
  make_folder(folder);
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (cloud_number(entry->path().filename().string()) >= fragments) {
      throw IoError(
          entry->path().string() + ": this cloud is of a scene with more than " +
          std::to_string(fragments) +
          " fragments and would be taken for one of them; remove it or choose another folder");
    }
  }
  if (error) throw IoError(folder + ": cannot read this folder: " + error.message());
  for (const char* name : {"gt.log", "gt.info", "gt_all.log", "gt_all.info", "gt_overlap.txt",
                           "poses.txt", "cameras.txt", "surface.ply"}) {
    fs::remove(fs::path(folder) / name, error);
    if (error)
      throw IoError(folder + "/" + name + ": cannot replace this file: " + error.message());
  }
  if (!rgbd) return;
  make_folder(fs::path(folder) / "rgb");
  make_folder(fs::path(folder) / "depth");
}

void write_cloud(const std::string& path, const std::vector<Eigen::Vector3f>& points,
                 const std::vector<Eigen::Vector3f>& normals) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                      std::to_string(points.size()) +
                      "\nproperty float x\nproperty float y\nproperty float z\n";
  if (!normals.empty()) bytes += "property float nx\nproperty float ny\nproperty float nz\n";
  bytes += "end_header\n";
  bytes.reserve(bytes.size() + 12 * (points.size() + normals.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) append(bytes, points[i][axis]);
    for (int axis = 0; axis < 3 && !normals.empty(); ++axis) append(bytes, normals[i][axis]);
  }
  files::write_atomically(path, bytes);
}

void write_poses(const std::string& path,
                 const std::vector<Eigen::Isometry3d>& world_from_fragment) {
  std::string text;
  char line[160];
  for (std::size_t i = 0; i < world_from_fragment.size(); ++i) {
    text += std::to_string(i) + "\n";
    const Eigen::Matrix4d m = world_from_fragment[i].matrix();
    for (int row = 0; row < 4; ++row) {
      std::snprintf(line, sizeof(line), "%.10f %.10f %.10f %.10f\n", m(row, 0), m(row, 1),
                    m(row, 2), m(row, 3));
      text += line;
    }
  }
  files::write_atomically(path, text);
}

Eigen::Vector4d quaternion(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(pose.rotation()).normalized();
  return q.w() < 0 ? Eigen::Vector4d(-q.coeffs()) : q.coeffs();
}

void write_cameras(const std::string& path,
                   const std::vector<std::vector<Eigen::Isometry3d>>& fragment_from_camera) {
  std::string text;
  char line[192];
  for (std::size_t i = 0; i < fragment_from_camera.size(); ++i) {
    for (std::size_t k = 0; k < fragment_from_camera[i].size(); ++k) {
      const Eigen::Vector3d t = fragment_from_camera[i][k].translation();
      const Eigen::Vector4d q = quaternion(fragment_from_camera[i][k]);
      std::snprintf(line, sizeof(line), "%zu %zu %.5f %.5f %.5f %.6f %.6f %.6f %.6f\n", i, k, t.x(),
                    t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
      text += line;
    }
  }
  files::write_atomically(path, text);
}

}  // namespace gpureg::synthetic
