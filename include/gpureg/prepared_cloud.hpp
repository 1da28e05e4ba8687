// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "gpureg/options.hpp"
#include "gpureg/statistics.hpp"

namespace gpureg {

struct Access;
struct PreparedState;

/// A fragment ready for alignment: downsampled points, normals, features, search grid and depth
/// maps, in the memory of the context that made it. Immutable and shareable between threads; copies
/// share the data. Usable with any context of the same backend: a device that lacks a cloud gets a
/// copy of it.
class PreparedCloud {
 public:
  PreparedCloud() = default;  ///< empty handle; valid() is false

  bool valid() const { return state_ != nullptr; }
  std::size_t size() const;               ///< prepared points
  std::size_t feature_dimension() const;  ///< 33 for FPFH
  const PrepareStatistics& statistics() const;
  const PrepareOptions& options() const;

  /// host copy, size() points in the cloud's frame
  /// PointCloudView::origin: added to points() and viewpoints() it gives the cloud's frame.
  Eigen::Vector3d origin() const;
  std::vector<Eigen::Vector3f> points() const;
  /// host copy, unit length, or (0,0,0) where none could be computed
  std::vector<Eigen::Vector3f> normals() const;
  /// host copy, size() x feature_dimension(), row by row
  std::vector<float> features() const;
  std::vector<Eigen::Vector3f> viewpoints() const;  ///< sensor positions, at least one

 private:
  friend struct Access;
  explicit PreparedCloud(std::shared_ptr<const PreparedState> state) : state_(std::move(state)) {}
  std::shared_ptr<const PreparedState> state_;
};

}  // namespace gpureg
