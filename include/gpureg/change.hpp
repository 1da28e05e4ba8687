// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gpureg/localization.hpp"

/// What has changed between a map and a scan. Part of component `localization`.
namespace gpureg::localization {

enum class ChangeLabel : std::uint8_t {
  same,         ///< the other cloud has the same surface there
  appeared,     ///< of the scan: "new", where the map saw empty space
  gone,         ///< of the map: the scan saw empty space there
  occluded,     ///< the other cloud looked there, but something stood before it
  not_observed  ///< the other cloud never looked there, or nobody knows from where it was seen
};
/// "same", "new", "gone", "occluded", "not_observed".
const char* to_string(ChangeLabel label);

/// Options of find_changes(). Lengths are in voxels of the map.
struct ChangeOptions {
  /// Surfaces closer together than this are the same, > 0.
  double tolerance = 1;
  /// Uncertainty of the pose, one standard deviation: twice what it moves a point by is added to
  /// the tolerance there. Voxels and degrees, >= 0.
  double translation_sigma = 0.1, rotation_sigma = 0.1;
  /// Changes of a smaller extent are taken for noise, >= 0.
  double min_extent = 2;
  /// Sensor positions of each cloud whose free space is compared, spread evenly, 1..4096.
  std::uint32_t viewpoints = 64;
  /// Refine the pose by ICP first.
  bool refine = true;

  /// @throws InvalidArgument naming field and value.
  void validate() const;
};

/// Labels of the points of one cloud, in their order.
struct PointChanges {
  std::vector<ChangeLabel> labels;
  std::vector<float> probabilities;  ///< that the label is correct, [0, 1]

  std::size_t count(ChangeLabel label) const;
};

/// Result of find_changes(). A plain value.
struct ChangeResult {
  UnalignedIsometry3d map_from_scan = no_pose();  ///< as given, or refined
  double inlier_ratio = 0;  ///< share of the scan on surfaces of the map; low: a wrong pose
  PointChanges scan;        ///< of the given points; not finite: not_observed, probability 0
  PointChanges map;         ///< of PreparedMap::cloud()
};

/// Compares a scan with the map around it, point by point. A point is new or gone only if the
/// other cloud saw through it: between one of its sensor positions and the surface behind. In a map
/// without sensor positions, a point of the scan is new if it stands before a surface of the
/// map, as seen from the scan.
///
/// @param scan host memory; viewpoints as for prepare().
/// @param map_from_scan p_map = map_from_scan * p_scan, as of locate().
/// @return the same bits on every backend and for any number of threads.
/// @throws InvalidArgument as prepare(), for an empty map, a pose that is no rigid motion, and a
///   scan that looks as if it was in another unit. Thread-safe.
ChangeResult find_changes(const Context& context, const PointCloudView& scan,
                          const PreparedMap& map, const UnalignedIsometry3d& map_from_scan,
                          const ChangeOptions& options = {});

/// Writes a cloud as a binary PLY with red, green, blue and label (of ChangeLabel) as bytes and the
/// probability as float: same grey, new green, gone red, occluded blue, not observed light grey.
/// x y z are float, or double if the cloud has an origin. All or nothing. Thread-safe.
/// @throws InvalidArgument if points, labels and probabilities differ in number, and for a label
///   that is none.
/// @throws IoError if writing fails.
void write_changes(const std::string& path, const PointCloud& cloud, const PointChanges& changes);

}  // namespace gpureg::localization
