// SPDX-License-Identifier: BSD-3-Clause
#include "localization/surface.hpp"

#include <algorithm>
#include <cmath>

#include "api/raw_cloud.hpp"
#include "common/coordinates.hpp"
#include "common/rigid.hpp"
#include "common/validate.hpp"
#include "common/whole.hpp"
#include "common/without_features.hpp"
#include "spacing/stray_points.hpp"

namespace gpureg::localization {
namespace {

/// For the sides of surfaces: points of half a voxel, no features.
PrepareSettings side_options(PrepareSettings options) {
  options.voxel_size /= 2;
  options.depth_maps = 1;
  options.surface_side_distance = 0;
  options.wide_feature_radius = 0;
  return options;
}

}  // namespace

PointCloud seen_surface(const Context& context, const PointCloudView& scan,
                        const PrepareSettings& options) {
  if (scan.size == 0) return {};
  const WithoutFeatures without(scan.size);
  const PreparedCloud prepared = prepare(context, without.of(scan), side_options(options));
  PointCloud out;
  out.points = prepared.points();
  out.origin = prepared.origin();
  const ViewpointSource source = prepared.statistics().viewpoint;
  if (source != ViewpointSource::none) out.normals = prepared.normals();
  if (source == ViewpointSource::given || source == ViewpointSource::origin)
    out.viewpoints = prepared.viewpoints();
  return out;
}

void check_rigid(const UnalignedIsometry3d& pose) { require_rigid(pose, "map_from_scan"); }

std::vector<std::size_t> kept_rows(const PointCloudView& view, const PrepareSettings& options) {
  const WithoutStrayPoints without(raw_cloud(view), options);
  if (!without.rows().empty()) return {without.rows().begin(), without.rows().end()};
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < view.size; ++k)
    if (Eigen::Map<const Eigen::Vector3f>(view.points + k * view.point_stride).allFinite())
      out.push_back(k);
  return out;
}

SurfaceDistance::SurfaceDistance(const Surface& surface, float reach)
    : surface_(surface), reach_(reach) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
  for (std::uint32_t k = 0; k < surface.points.size(); ++k)
    keys.emplace_back(key_of(cell_of(surface.points[k])), k);
  std::sort(keys.begin(), keys.end());
  for (std::uint32_t k = 0; k < keys.size(); ++k) {
    const auto found = cells_.try_emplace(keys[k].first, k, k).first;
    found->second.second = k + 1;
    order_.push_back(keys[k].second);
  }
}

SurfaceDistance::Cell SurfaceDistance::cell_of(const Eigen::Vector3f& p) const {
  return p.unaryExpr([&](float coordinate) { return cell_at(coordinate, reach_); });
}

/// Cells of one key are 2^21 cells apart: their points are too far away to count.
std::uint64_t SurfaceDistance::key_of(const Cell& cell) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << 21) - 1;
  const auto part = [&](int axis) { return static_cast<std::uint64_t>(cell[axis]) & kMask; };
  return part(0) << 42 | part(1) << 21 | part(2);
}

float SurfaceDistance::at(const Eigen::Vector3f& p) const {
  const Cell centre = cell_of(p);
  // Beside a disc as far as its neighbour, its plane still tells where the surface is.
  const float beside = 1.5f * surface_.spacing, squared_beside = beside * beside;
  float least = reach_;
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) {
        const auto cell = cells_.find(key_of(centre + Cell(x, y, z)));
        if (cell == cells_.end()) continue;
        for (std::uint32_t k = cell->second.first; k < cell->second.second; ++k) {
          const std::uint32_t i = order_[k];
          const Eigen::Vector3f d = p - surface_.points[i];
          const float squared = d.squaredNorm(), along = surface_.normals[i].dot(d);
          const bool known = surface_.normals[i].squaredNorm() > 0;
          if (known && squared - along * along > squared_beside) continue;
          least = std::min(least, known ? std::abs(along) : std::sqrt(squared));
        }
      }
  return least;
}

void check_place(const UnalignedIsometry3d& map_from_scan) {
  check_rigid(map_from_scan);
  const double farthest = map_from_scan.translation().cwiseAbs().maxCoeff();
  require(farthest <= limits::kMaxCoordinate, "map_from_scan.translation", farthest,
          "coordinates of at most 1e12");
}

}  // namespace gpureg::localization
