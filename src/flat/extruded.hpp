// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "pipeline/scan_plane.hpp"
#include "pipeline/types.hpp"

namespace gpureg {

/// Between the layers of a 2-D scan, metres.
double layer_distance(const PrepareSettings& options);

/// A cloud for the engines: that of a 2-D scanner in layers along the normal of its plane, so that
/// its curves become surfaces; every other one as it is. It is decided on the host, so that
/// backends agree bit for bit.
class Extruded {
 public:
  /// Odd, so that one layer is the scan itself. Features need a height of some voxels, and points
  /// cost time.
  static constexpr std::uint32_t kLayers = 9;

  /// @param raw rows in host memory, which have to outlive this unless plane() exists.
  /// @param model see PointCloudView::model; a model is no scan.
  Extruded(const RawCloud& raw, bool model, const PrepareSettings& options);

  /// Valid as long as this object and the rows given to it.
  const RawCloud& cloud() const { return cloud_; }
  const ScanPlane& plane() const { return plane_; }
  /// Corrects the counts of the cloud's preparation.
  void count(PrepareStatistics& statistics) const;

 private:
  RawCloud cloud_;
  ScanPlane plane_;
  std::vector<float> points_, normals_, features_, viewpoints_;
};

}  // namespace gpureg
