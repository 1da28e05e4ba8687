// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cell.hpp"

namespace gpureg {

/// Centre of a cloud's bounding box, rounded to a multiple of the voxel size: the local origin of
/// its points. A cloud ten kilometres from the origin of its frame then loses no precision after
/// the subtraction, and voxels stay those of floor(x / voxel_size).
GPUREG_HD float local_origin(float lo, float hi, float voxel_size) {
  const double mid = 0.5 * (static_cast<double>(lo) + static_cast<double>(hi));
  // + 0: a box with an edge at -0 must have the same origin as one at 0.
  if (!(voxel_size > 0.0f)) return static_cast<float>(mid) + 0.0f;
  const double steps = mid / static_cast<double>(voxel_size);
  // From 2^53 on every double is an integer; from 2^63 on it has no std::int64_t.
  if (!(steps > -9e18 && steps < 9e18)) return static_cast<float>(mid) + 0.0f;
  const double whole =
      static_cast<double>(static_cast<std::int64_t>(steps + (steps < 0.0 ? -0.5 : 0.5)));
  // + 0 here too: compilers differ in the sign of a zero converted from an integer.
  return static_cast<float>(whole * static_cast<double>(voxel_size)) + 0.0f;
}

/// Factor that keeps |point| / radius at most 1 in float.
constexpr float kRadiusMargin = 1.0001f;

/// Voxel of a local point.
GPUREG_HD Cell voxel_of(Vec3 local, float inverse_voxel_size) {
  return cell_of(local, inverse_voxel_size);
}

}  // namespace gpureg
