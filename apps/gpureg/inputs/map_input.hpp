// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gpureg/localization.hpp"
#include "inputs/scan_input.hpp"

namespace gpureg::cli {

/// A map as the command line names it: a file of `--save-map`, a cloud or mesh, a folder (pattern,
/// list) of scans with their poses in poses.txt or trajectory.txt beside them, or the output folder
/// of `gpureg reconstruct`, of which the largest island counts.
struct MapInput {
  std::string path;
  bool recursive = false;  ///< of a folder of scans
  enum class Kind { saved, cloud, scans } kind = Kind::cloud;
  std::optional<localization::PreparedMap> saved;  ///< of a saved map

  /// Recognises the kind; reads a saved map. Throws IoError.
  explicit MapInput(std::string of, bool with_subfolders = false);

  /// Of a saved map; else the given ones.
  localization::MapOptions options_or(const localization::MapOptions& otherwise) const {
    return saved ? saved->options() : otherwise;
  }

  /// The cloud, or some scans of the folder, evenly chosen, to judge their spacing by.
  std::vector<PointCloud> sample() const;

  /// Makes the map of a cloud or of scans; a saved one is returned as it is.
  /// @throws IoError, InvalidArgument naming the file.
  localization::PreparedMap prepare(const Context& context,
                                    const localization::MapOptions& options) const;
};

/// Whether there are poses of the scans of a folder: a reconstruction.json, poses.txt or
/// trajectory.txt.
bool has_poses(const ScanInput& input);

/// A scan as the command line names it: a cloud or mesh, or a folder of scans with their poses by
/// odometry, which become one.
/// @throws IoError, InvalidArgument naming the file.
PointCloud read_scan(const std::string& path, const Context& context,
                     const localization::MapOptions& options);

}  // namespace gpureg::cli
