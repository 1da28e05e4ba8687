// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/closest.hpp"
#include "algorithm/moments.hpp"
#include "algorithm/support.hpp"
#include "gpureg/options.hpp"
#include "gpureg/statistics.hpp"

/// What goes through the pipeline: plain data, no Eigen, so that stages may be compiled with flags of their own.
namespace gpureg {

/// A cloud as the caller has it (host memory): PointCloudView after validation.
struct RawCloud {
  const float* points;
  std::size_t size, point_stride;
  const float* normals;
  std::size_t normal_stride;
  const float* features;
  std::size_t feature_dimension, feature_stride;
  const float* viewpoints;
  std::size_t viewpoint_count;
};

/// A prepared cloud as alignment reads it. Pointers are on the executor's side; points are relative to the cloud's local origin.
struct CloudView {
  const Vec3* points;
  const Vec3* normals;
  const float* features;            ///< size x feature_dimension
  const std::uint8_t* has_feature;  ///< 0: the row is not to be matched
  std::uint32_t size;
  std::uint32_t feature_dimension;
  float radius;                     ///< largest distance of a point from the local origin, > 0
  ClosestGridView closest;
  const void* executor_data;        ///< what the executor keeps beside, for itself
};

/// One pair as stages see it. matches: the caller's own correspondences instead of features; count 0 and null otherwise.
struct PairView {
  CloudView source;
  CloudView target;
  const std::uint32_t* custom_source;
  const std::uint32_t* custom_target;
  std::uint32_t custom_count;
};

/// Result of one pair in local coordinates of both clouds.
struct PairOutcome {
  RegistrationReason reason = RegistrationReason::none;
  bool has_pose = false;
  Pose<double> pose{1, 0, 0, 0, 0, 0, 0};
  Support support{0, 0, 0};
  Moments source_moments{0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
  Moments target_moments{0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}};
  RegistrationStatistics statistics;
  StageTimings timings;
};

}  // namespace gpureg
