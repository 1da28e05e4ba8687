// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gpureg/point_cloud.hpp"

/// A voxel size from the clouds themselves.
namespace gpureg {

/// Why there is no suggestion. none: there is one.
enum class VoxelSizeReason : std::uint8_t {
  none,
  no_clouds,
  too_few_points,  ///< no cloud has 4 or more points with finite coordinates
  one_place        ///< all points of each cloud are at one place
};

const char* to_string(VoxelSizeReason reason);
/// One sentence for a person.
const char* explain(VoxelSizeReason reason);

/// Lengths in the unit of the points.
struct VoxelSizeSuggestion {
  float voxel_size = 0;  ///< for RegistrationOptions::from_voxel_size(); 0: none, see reason
  VoxelSizeReason reason = VoxelSizeReason::no_clouds;
  double spacing = 0;  ///< median distance of a point to its nearest neighbour at another place
  /// median distance (RMS) of points from the plane of their surroundings, about a voxel wide
  double noise = 0;
  std::size_t points = 0;  ///< that a cloud keeps, in the median

  bool valid() const { return reason == VoxelSizeReason::none; }
};

/// The voxel size that suits all the clouds of a set: it leaves about 5,000 points of the median
/// cloud, which registration works well and fast with, but is not below the spacing of the points;
/// where surfaces are rougher than a third of it, it grows, as far as 3,000 points are left.
/// Rounded to one or two digits. At most 16 clouds, evenly chosen, and samples of their points are
/// looked at; rows with NaN or infinity and repeated points do not matter, nor does the unit.
///
/// views: host memory. Deterministic, thread-safe. Bad data is a reason; bad views (see
/// PointCloudView::validate) are InvalidArgument.
VoxelSizeSuggestion suggest_voxel_size(const std::vector<PointCloudView>& views);

}  // namespace gpureg
