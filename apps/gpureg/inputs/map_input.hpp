// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "gpureg/localization.hpp"

namespace gpureg::cli {

/// A map as the command line names it: a file of `--save-map`, a cloud or mesh, a folder of scans
/// with their poses in poses.txt or trajectory.txt, or the output folder of `gpureg reconstruct`,
/// of which the largest island counts.
struct MapInput {
  std::string path;
  enum class Kind { saved, cloud, scans } kind = Kind::cloud;
  std::optional<localization::PreparedMap> saved;  ///< of a saved map

  /// Recognises the kind; reads a saved map. Throws IoError.
  explicit MapInput(std::string of);

  /// Of a saved map; else the given ones.
  localization::MapOptions options_or(const localization::MapOptions& otherwise) const {
    return saved ? saved->options() : otherwise;
  }

  /// Makes the map of a cloud or of scans; a saved one is returned as it is.
  /// @throws IoError, InvalidArgument naming the file.
  localization::PreparedMap prepare(const Context& context,
                                    const localization::MapOptions& options) const;
};

/// The folder of the scans of a reconstruction.json, which names it from where `reconstruct` ran,
/// or the folder of that name beside the output of `reconstruct`.
/// @throws IoError naming the file: damaged, or neither folder is there.
std::string scans_of_reconstruction(const std::string& file);

/// A scan as the command line names it: a cloud or mesh, or a folder of scans with their poses by
/// odometry, which become one.
/// @throws IoError, InvalidArgument naming the file.
PointCloud read_scan(const std::string& path, const Context& context,
                     const localization::MapOptions& options);

}  // namespace gpureg::cli
