// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/closest.hpp"
#include "algorithm/surface_sides.hpp"
#include "algorithm/visibility.hpp"

namespace gpureg {

/// View of a prepared cloud for alignment. Pointers are on the side of the executor; points are
/// relative to the local origin of the cloud.
struct CloudView {
  const Vec3* points;
  const Vec3* normals;
  const float* features;            ///< size x feature_dimension
  const std::uint8_t* has_feature;  ///< 0: the row is never matched
  std::uint32_t size;
  std::uint32_t feature_dimension;
  float radius;  ///< largest distance of a point from the local origin, > 0
  ClosestGridView closest;
  const void* executor_data;  ///< further data of the executor
  /// Features of the wide radius, size x feature_dimension; null: none.
  const float* wide_features;
  const std::uint8_t* has_wide_feature;
  const std::uint32_t* normal_weight;  ///< weight of each point, see normal_weight.hpp
  std::uint64_t normal_weight_total;
  VisibilityView visibility;      ///< depth maps; none where no viewpoint is known
  SurfaceSideView surface_sides;  ///< none where the option is 0 or the cloud too wide
};

}  // namespace gpureg
