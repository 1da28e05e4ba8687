// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"
#include "gpureg/sets/fragment_set.hpp"

namespace gpureg {

/// The scans of a folder, a pattern or a list, as the command takes them: link gpureg::io. Formats
/// that need Python (LAS, points of E57) are not read.
class ScanFiles : public FragmentSet {
 public:
  /// @param path, recursive as for io::list_scans(); sensor positions are those of cameras.txt
  ///   beside the scans, else those of the files.
  /// @throws IoError where the path has no scans.
  explicit ScanFiles(const std::string& path, bool recursive = false)
      : scans_(io::list_scans(path, recursive)) {
    const std::filesystem::path cameras =
        std::filesystem::path(io::folder_of_scans(path)) / "cameras.txt";
    if (std::filesystem::exists(cameras)) cameras_ = io::read_cameras(cameras.string(), scans_);
  }

  std::size_t size() const override { return scans_.size(); }
  std::string name(std::size_t k) const override { return scans_[k].name; }
  std::string label(std::size_t k) const override { return scans_[k].path; }
  int number(std::size_t k) const { return scans_[k].number; }  ///< as Redwood's files have it

  LoadedCloud read(std::size_t k, const RegistrationOptions& options) const override {
    const std::string& path = scans_[k].path;
    const double spacing = 0.5 * static_cast<double>(options.voxel_size);
    PointCloud cloud = io::is_mesh(path) ? io::sample_mesh(io::read_mesh(path), spacing)
                                         : io::read_point_cloud(path);
    if (const auto found = cameras_.find(number(k)); found != cameras_.end())
      cloud.set_viewpoints(found->second);
    return LoadedCloud(std::move(cloud));
  }

 private:
  std::vector<io::ScanFile> scans_;
  std::map<int, std::vector<Eigen::Vector3d>> cameras_;
};

}  // namespace gpureg
