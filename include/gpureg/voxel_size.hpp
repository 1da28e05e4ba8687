// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "gpureg/point_cloud.hpp"

/// Suggests a voxel size from the clouds themselves.
namespace gpureg {

/// Reason for a missing suggestion; none: there is a suggestion.
enum class VoxelSizeReason : std::uint8_t {
  none,
  no_clouds,
  too_few_points,  ///< no cloud has 4 or more points with finite coordinates
  one_place        ///< all points of each cloud coincide
};

/// @return the name of the enumerator.
const char* to_string(VoxelSizeReason reason);
/// @return one English sentence for messages.
const char* explain(VoxelSizeReason reason);

/// Suggestion of suggest_voxel_size(). Lengths are in the unit of the points.
struct VoxelSizeSuggestion {
  float voxel_size = 0;  ///< for RegistrationOptions; 0: none, see reason
  VoxelSizeReason reason = VoxelSizeReason::no_clouds;
  double spacing = 0;  ///< median distance of a point to its nearest distinct neighbour
  /// Median RMS distance of points from the plane fitted to their neighbourhood, about a voxel
  /// wide.
  double noise = 0;
  /// Most of the clouds are scans of a 2-D scanner; noise is then the distance from a line.
  bool flat = false;
  std::size_t points = 0;  ///< median number of points that a cloud keeps

  bool valid() const { return reason == VoxelSizeReason::none; }
};

/// Suggests one voxel size for a set of clouds: about 5,000 points of the median cloud remain,
/// enough for an accurate and fast registration, and the voxel is not below the spacing of the
/// points. If the noise exceeds a third of a voxel, it grows until 3,000 points remain. It also
/// grows if the neighbourhoods of the features have few points, as in sparse LiDAR scans, in
/// proportion to them, and if most points have their neighbours on one line, as on the rings of
/// a LiDAR, until they have an area. 1,000 points remain, of every cloud that has as many (a part
/// on a scene), and 3,000 of the smaller one of two, where the other one keeps three times as many
/// (a sweep in a model), as far as the median cloud then keeps at most 100,000 (two clouds) or
/// 20,000 (more). Scans of 2-D scanners keep about 300 points, in layers. Rounded to one or two
/// digits. Reads at most 16 clouds, evenly chosen, and samples of their points; non-finite and
/// repeated points do not matter. Deterministic, thread-safe.
/// @param views host memory, all in one unit.
/// @return the suggestion, or the reason why the data allows none.
/// @throws InvalidArgument as PointCloudView::validate().
VoxelSizeSuggestion suggest_voxel_size(const std::vector<PointCloudView>& views);

/// Ratio of extents that is suspect whatever became of the pair.
constexpr double kSuspectRatio = 50;
/// Ratio of feet to metres is the smallest that is worth a question, if a pair did not align: a
/// part is smaller than its scene, too.
constexpr double kLeastUnitRatio = 2.5;

/// Asks whether two clouds have different units, if the ratio of their extents is that of usual
/// units (within 20 %) or above kSuspectRatio. Stray points do not matter. Thread-safe.
/// @param source host memory.
/// @param target host memory.
/// @param least_ratio no question below.
/// @return "are the units different? target is 1045 times larger than source, as with millimetres
///   and metres"; empty: nothing suspect.
/// @throws InvalidArgument as PointCloudView::validate().
std::string question_units(const PointCloudView& source, const PointCloudView& target,
                           double least_ratio = kSuspectRatio);

}  // namespace gpureg
