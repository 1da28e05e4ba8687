// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gpureg/reconstruction/reconstruct.hpp"
#include "inputs/scene.hpp"

namespace gpureg::cli {

/// Everything that `gpureg reconstruct` knows at its end, for the files that it writes.
struct MapRun {
  ScanInput input;
  std::string output;
  RegistrationOptions options;
  FragmentFolder scene;  ///< the scans of the map
  reconstruction::MapOfSet made;
  /// Of each scan of the map: the map's unit per unit of the scan; empty: all 1. Poses of `made`
  /// are those of the scaled scans.
  std::vector<double> scales;
  bool aligned_here = false;  ///< the pairs were aligned by this run
  std::size_t map_points = 0;
  double seconds_of_writing = 0;

  std::string file(const std::string& name) const;  ///< path in the output folder
  std::size_t accepted_edges() const;
  double scale(std::size_t scan) const { return scales.empty() ? 1 : scales[scan]; }
  /// 4 x 4 of a placed scan as it is in its file: with its scale.
  Eigen::Matrix4d island_from_scan(std::size_t scan) const;
  /// A relative pose of scaled scans as one of the scans in their files.
  Eigen::Matrix4d of_files(std::size_t source, std::size_t target,
                           const UnalignedIsometry3d& target_from_source) const;
};

}  // namespace gpureg::cli
