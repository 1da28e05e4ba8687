// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/closest.hpp"
#include "algorithm/fronts.hpp"
#include "algorithm/visibility.hpp"

namespace gpureg {

/// A prepared cloud as alignment reads it. Pointers are on the executor's side; points are relative
/// to the cloud's local origin.
struct CloudView {
  const Vec3* points;
  const Vec3* normals;
  const float* features;            ///< size x feature_dimension
  const std::uint8_t* has_feature;  ///< 0: the row is not to be matched
  std::uint32_t size;
  std::uint32_t feature_dimension;
  float radius;  ///< largest distance of a point from the local origin, > 0
  ClosestGridView closest;
  const void* executor_data;  ///< what the executor keeps beside, for itself
  /// null, or features of the wide radius, size x feature_dimension
  const float* wide_features;
  const std::uint8_t* has_wide_feature;
  const std::uint32_t* balance;  ///< weight of each point, see balance.hpp
  std::uint64_t balance_total;
  VisibilityView visibility;  ///< no maps where viewpoints are not known or not asked for
  FrontView fronts;           ///< none where not asked for, or the cloud is too wide
};

}  // namespace gpureg
