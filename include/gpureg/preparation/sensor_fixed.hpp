// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "gpureg/point_cloud.hpp"

/// Points that are fixed to the sensor. They lie at the same place in its frame wherever it goes,
/// so they support the pose at which it did not move, and no other one.
namespace gpureg {

/// Points at the limits of the sensor's range, written by many sensors for rays without a return.
struct RangeLimits {
  std::uint64_t smallest_points = 0, largest_points = 0;
  double smallest_range = 0, largest_range = 0;  ///< in the unit of the points

  std::uint64_t points() const { return smallest_points + largest_points; }
};

/// Finds points at the limits of the range: as seen from the first viewpoint (the origin of the
/// frame where none is given), far more of them in the last hundredth of the ranges or less than
/// any surface has there, in directions that a plane could not have within that distance. A surface
/// that is a sphere about the sensor looks the same; it is taken for one where it has more than a
/// third of the points. Models and clouds with normals but without viewpoints have no limits. Reads
/// a sample, and all points where that is suspect. Thread-safe.
/// @param cloud host memory.
/// @throws InvalidArgument as PointCloudView::validate().
RangeLimits range_limits(const PointCloudView& cloud);

/// Parts of the sensor's carrier that its scans show: the vehicle, the tripod, a hand.
struct FixedParts {
  using Cell = std::array<std::int32_t, 3>;
  float cell = 0;           ///< edge of a cell, in the unit of the points
  std::vector<Cell> cells;  ///< ascending; cell c has the points p with floor(p / cell) = c
};

/// Finds parts that are fixed to the sensor in a set of scans: connected points near the sensor
/// that most scans have at the same place as seen from their first viewpoint (or the origin), apart
/// from everything that is elsewhere in other scans. None where half of a scan is constant: those
/// scans were taken from one place; none in fewer than four scans. Reads samples of eight scans,
/// evenly chosen. Thread-safe.
/// @param clouds host memory, in the frames of their sensors. Models and clouds with normals but
///   without viewpoints count for nothing.
/// @throws InvalidArgument as PointCloudView::validate().
FixedParts find_fixed_parts(const std::vector<PointCloudView>& clouds);

/// @return rows of a cloud of the set that belong to the parts or touch them, ascending.
/// @throws InvalidArgument as PointCloudView::validate().
std::vector<std::uint32_t> rows_in(const FixedParts& parts, const PointCloudView& cloud);

}  // namespace gpureg
