// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "gpureg/options.hpp"

namespace gpureg {

struct PreparedState;

/// Counts and wall times (milliseconds) of the preparation of one cloud.
struct PrepareStatistics {
  std::uint64_t input_points = 0;
  std::uint64_t invalid_points = 0;       ///< dropped for NaN or infinite coordinates
  std::uint32_t points = 0;               ///< after downsampling
  std::uint32_t points_without_normal = 0;   ///< fewer than 3 neighbours
  std::uint32_t points_without_feature = 0;  ///< no neighbour within the feature radius, or no normal: never matched
  double downsample = 0, normals = 0, features = 0, grid = 0;
  double total() const { return downsample + normals + features + grid; }
};

/// A fragment ready for alignment: downsampled points, normals, features and search grid, in the memory of the context that made it.
/// Immutable and shareable between threads; copies share the data. Usable with any context of the same backend and device.
class PreparedCloud {
 public:
  PreparedCloud() = default;  ///< empty handle; valid() is false
  explicit PreparedCloud(std::shared_ptr<const PreparedState> state) : state_(std::move(state)) {}

  bool valid() const { return state_ != nullptr; }
  std::size_t size() const;                        ///< prepared points
  std::size_t feature_dimension() const;           ///< 33 for FPFH
  const PrepareStatistics& statistics() const;
  const PrepareOptions& options() const;

  std::vector<Eigen::Vector3f> points() const;     ///< host copy, size() points in the cloud's frame
  std::vector<Eigen::Vector3f> normals() const;    ///< host copy, unit length, or (0,0,0) where none could be computed
  std::vector<float> features() const;             ///< host copy, size() x feature_dimension(), row by row
  std::vector<Eigen::Vector3f> viewpoints() const; ///< sensor positions, at least one

  const std::shared_ptr<const PreparedState>& state() const { return state_; }

 private:
  std::shared_ptr<const PreparedState> state_;
};

}  // namespace gpureg
