// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "pipeline/scan_plane.hpp"
#include "pipeline/types.hpp"

namespace gpureg {

struct PointsAndNormals {
  std::vector<Vec3> points, normals;
};

/// Points and normals of a cloud while its preparation goes on.
struct EarlySurface : PointsAndNormals {
  float origin[3];  ///< local origin, as in PreparedState
};
/// Takes those of consecutive clouds of a batch from `first` on. A preparation that fails and is
/// tried again may give those of a cloud twice, from several threads; they are equal.
using SurfaceWatcher = std::function<void(std::size_t first, std::vector<EarlySurface> surfaces)>;

/// What the host knows of a prepared cloud.
struct PreparedFacts {
  /// Identifies the memory that holds the data: clouds of one owner can be aligned.
  const void* owner = nullptr;
  PrepareSettings options;
  PrepareStatistics statistics;
  float origin[3] = {0, 0, 0};  ///< local origin, relative to the caller's rows
  double frame_offset[3] = {0, 0,
                            0};  ///< from the cloud's frame to the rows, PointCloudView::origin
  ScanPlane plane;               ///< of a scan of a 2-D scanner
  std::uint32_t size = 0;
  std::uint32_t feature_dimension = 0;
  std::uint64_t normal_weight_total = 0;  ///< see CloudView
  float radius = 1;                       ///< see CloudView
  std::vector<Vec3> viewpoints;           ///< relative to the local origin
};

/// Content of a PreparedCloud: facts on the host, data in the memory of its engine.
struct PreparedState : PreparedFacts {
  virtual ~PreparedState() = default;
  /// Host copies, relative to the local origin.
  virtual std::vector<Vec3> copy_points() const = 0;
  virtual std::vector<Vec3> copy_normals() const = 0;
  virtual std::vector<float> copy_features() const = 0;
  /// With one wait where they are on a device.
  virtual PointsAndNormals copy_points_and_normals() const {
    return {copy_points(), copy_normals()};
  }

  /// The same cloud with the other sides of its surfaces, where nobody knows them; else null.
  std::shared_ptr<PreparedState> other_sides;
  /// The cloud with each of its one or two sides.
  std::vector<const PreparedState*> with_sides() const {
    if (!other_sides) return {this};
    return {this, other_sides.get()};
  }
};

/// Whether both clouds are scans of 2-D scanners: the pose is planar.
inline bool planar_pair(const PreparedState& a, const PreparedState& b) {
  return a.plane.exists() && b.plane.exists();
}

/// A pair of clouds for the engine, optionally with given correspondences.
struct PairInput {
  const PreparedState* source;
  const PreparedState* target;
  Span<const std::uint32_t> custom_source{};
  Span<const std::uint32_t> custom_target{};
  PriorTest prior{};
};

}  // namespace gpureg
