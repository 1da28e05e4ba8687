// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "gpureg/statistics.hpp"

namespace gpureg {

struct Access;
struct PrepareSettings;
struct PreparedState;

/// Point cloud prepared for alignment: downsampled points, normals, features, search grid and depth
/// maps, in the memory of the context that made it. An immutable handle: copies share the data, and
/// threads may share copies. Any context of the same backend accepts it; a device without the cloud
/// copies it from another.
///
/// The accessors throw InvalidArgument on an empty handle. Copies to the host wait for the device.
class PreparedCloud {
 public:
  PreparedCloud() = default;  ///< empty handle

  /// @return false for an empty handle.
  bool valid() const { return state_ != nullptr; }
  std::size_t size() const;               ///< number of prepared points
  std::size_t feature_dimension() const;  ///< floats per feature, 33 for FPFH
  const PrepareStatistics& statistics() const;
  float voxel_size() const;                 ///< RegistrationOptions::voxel_size
  const PrepareSettings& settings() const;  ///< for the library: a type of its own

  /// @return PointCloudView::origin: points() and viewpoints() are rows relative to it.
  Eigen::Vector3d origin() const;
  /// @return host copy: size() points, relative to origin().
  std::vector<Eigen::Vector3f> points() const;
  /// @return host copy: size() unit vectors, (0,0,0) if no normal could be estimated.
  std::vector<Eigen::Vector3f> normals() const;
  /// @return host copy: size() x feature_dimension() floats, row by row.
  std::vector<float> features() const;
  /// @return sensor positions relative to origin(), at least one.
  std::vector<Eigen::Vector3f> viewpoints() const;

 private:
  friend struct Access;
  explicit PreparedCloud(std::shared_ptr<const PreparedState> state) : state_(std::move(state)) {}
  std::shared_ptr<const PreparedState> state_;
};

}  // namespace gpureg
