// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unordered_map>

#include "api/with_settings.hpp"
#include "gpureg/localization.hpp"
#include "localization/horizon.hpp"

namespace gpureg::localization {

/// A scan as points of half a voxel, without features: with normals towards the sensor where it is
/// known from where the scan was seen, and with viewpoints where they are known.
PointCloud seen_surface(const Context& context, const PointCloudView& scan,
                        const PrepareSettings& options);

/// @throws InvalidArgument for a pose that is no rigid motion.
void check_rigid(const UnalignedIsometry3d& pose);
/// The same, and for one whose coordinates float does not hold.
void check_place(const UnalignedIsometry3d& map_from_scan);

/// Numbers of the points that prepare() keeps where it does not downsample: those that are finite
/// and not stray. The others have no normals.
std::vector<std::size_t> kept_rows(const PointCloudView& view, const PrepareSettings& options);

/// Small discs that a surface consists of, in one frame.
struct Surface {
  std::vector<Eigen::Vector3f> points, normals;  ///< normals of either sign; zero: not known
  std::vector<Eigen::Vector3f> viewpoints;
  std::vector<Horizon> horizons;  ///< empty, or one per viewpoint
  float spacing = 0;              ///< distance of neighbouring points
  float horizon_step = 0;
};

/// Distances to a surface.
class SurfaceDistance {
 public:
  /// reach: from which on distances do not matter.
  SurfaceDistance(const Surface& surface, float reach);

  /// Distance to the plane of a disc beside the location, at most reach.
  float at(const Eigen::Vector3f& p) const;

 private:
  using Cell = Eigen::Matrix<std::int64_t, 3, 1>;
  Cell cell_of(const Eigen::Vector3f& p) const;
  static std::uint64_t key_of(const Cell& cell);

  const Surface& surface_;
  float reach_;
  std::vector<std::uint32_t> order_;  ///< of the points, by cell
  std::unordered_map<std::uint64_t, std::pair<std::uint32_t, std::uint32_t>> cells_;
};

}  // namespace gpureg::localization
