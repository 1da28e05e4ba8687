// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "gpureg/point_cloud.hpp"
#include "gpureg/prepared_cloud.hpp"

namespace gpureg::calibration {

/// A part of a scan as a cloud of its own.
struct Part {
  std::vector<Eigen::Vector3f> points, normals, viewpoints;
  std::vector<float> features;
  std::size_t feature_dimension = 0;
  bool infer_viewpoint = true;

  PointCloudView view() const;
};

/// Two parts of one scan, the target moved.
struct Halves {
  Part source, target;
  Eigen::Isometry3d target_from_source = Eigen::Isometry3d::Identity();
};

/// Overlap that is asked for: one pair in four has none, so that its poses are false for certain.
inline constexpr double kMinOverlap = 0.1, kMaxOverlap = 0.9;
inline constexpr std::uint32_t kWithoutOverlap = 4;

/// Two disjoint halves of a scan. Deterministic in seed and number.
/// @param scan rows of the caller.
/// @param prepared the same scan; its points, evenly spread over the surfaces, place the planes.
/// @param noise standard deviation of the noise added, in the unit of the points.
/// @param wavelength shortest one of the smooth part of it.
Halves halves_of(const PointCloudView& scan, const PreparedCloud& prepared, double noise,
                 double wavelength, std::uint64_t seed, std::uint32_t number);

}  // namespace gpureg::calibration
