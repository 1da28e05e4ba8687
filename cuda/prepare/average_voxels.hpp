// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/stage_data.hpp"
#include "cuda/device/exec.hpp"

namespace gpureg::cuda {

/// Box of a raw cloud, and the largest norm of its local points.
struct Extent {
  std::int32_t lo[3], hi[3];  ///< floats as integers of the same order
  std::uint32_t finite;
  std::uint32_t largest_squared_norm;  ///< bits of a float >= 0
};

/// Raw points grouped by voxels, and where their averages go. All pointers are of the device.
struct Average {
  const std::uint32_t* raw_offset;
  const std::uint32_t* offset;  // of voxels
  const RawSlot* slots;
  const Extent* extents;
  const std::uint32_t* item;
  const std::uint32_t* start;
  const std::size_t* feature_offset;
  Vec3* points;
  Vec3* guides;  // null: no cloud has any
  float* features;
  std::uint32_t* largest_squared_norm;
};

/// Averages of the points, normals and features of each voxel, added up in input order.
/// clouds: their number; largest: voxels of the largest cloud; raw_points: of all clouds.
void average_voxels(Exec& exec, const Average& voxels, std::size_t clouds, std::uint32_t largest,
                    std::size_t raw_points);

}  // namespace gpureg::cuda
