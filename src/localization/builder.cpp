// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <set>

#include "gpureg/reconstruction.hpp"
#include "localization/check_scan.hpp"
#include "localization/sides.hpp"
#include "localization/surface.hpp"

namespace gpureg::localization {
namespace {

/// Sensor positions closer together than this number of voxels see the same.
constexpr double kViewpointVoxels = 10;

}  // namespace

struct MapBuilder::State {
  explicit State(const MapOptions& of)
      : given(of), options(resolve(of)), cells(options.prepare.voxel_size) {}

  /// Number of the sensor position that stands for the place.
  std::size_t add_viewpoint(const Eigen::Vector3d& place) {
    const Eigen::Array3d cell =
        (place / (kViewpointVoxels * static_cast<double>(options.prepare.voxel_size)))
            .array()
            .floor();
    const auto [at, is_new] = seen.try_emplace({cell[0], cell[1], cell[2]}, viewpoints.size());
    if (is_new) {
      viewpoints.push_back(place);
      horizons.emplace_back();
    }
    return at->second;
  }

  MapOptions given;
  MapSettings options;
  reconstruction::VoxelMap cells;
  std::vector<Eigen::Vector3d> viewpoints;
  std::vector<Horizon> horizons;
  std::map<std::array<double, 3>, std::size_t> seen;
};

MapBuilder::MapBuilder(const MapOptions& options) : state_(std::make_unique<State>(options)) {}
MapBuilder::~MapBuilder() = default;
MapBuilder::MapBuilder(MapBuilder&&) noexcept = default;
MapBuilder& MapBuilder::operator=(MapBuilder&&) noexcept = default;

void MapBuilder::add_scan(const Context& context, const PointCloudView& scan,
                          const UnalignedIsometry3d& map_from_scan) {
  check_place(map_from_scan);
  const PointCloud surface = seen_surface(context, scan, state_->options.prepare);
  state_->cells.add(surface.view(), map_from_scan);
  std::set<std::size_t> from;
  for (const Eigen::Vector3f& place : surface.viewpoints)
    from.insert(state_->add_viewpoint(map_from_scan * (place.cast<double>() + surface.origin)));
  const float step = horizon_step(state_->options.prepare.voxel_size);
  for (const std::size_t k : from)
    for (const Eigen::Vector3f& p : surface.points) {
      const Eigen::Vector3d place = map_from_scan * (p.cast<double>() + surface.origin);
      state_->horizons[k].see((place - state_->viewpoints[k]).cast<float>(), step);
    }
}

void MapBuilder::add_cloud(const PointCloudView& cloud) {
  state_->cells.add(cloud, UnalignedIsometry3d::Identity());
  const Eigen::Vector3d origin(cloud.origin[0], cloud.origin[1], cloud.origin[2]);
  for (std::size_t k = 0; k < cloud.viewpoint_count; ++k) {
    const std::size_t number = state_->add_viewpoint(
        Eigen::Map<const Eigen::Vector3f>(cloud.viewpoints + 3 * k).cast<double>() + origin);
    state_->horizons[number].steps.fill(Horizon::kUnlimited);  // which points it saw, nobody says
  }
}

PreparedMap MapBuilder::build() const {
  PointCloud cloud = state_->cells.cloud();
  if (cloud.points.empty()) throw InvalidArgument("the map has no points");
  refuse_flat(cloud.view(), "the map");
  check_map(cloud, state_->options);
  auto out = std::make_shared<MapState>();
  out->given = state_->given;
  out->options = state_->options;
  out->origin = cloud.origin;
  out->points = std::move(cloud.points);
  for (const Eigen::Vector3f& normal : cloud.normals) out->sides.push_back(side_of(normal));
  for (const Eigen::Vector3d& place : state_->viewpoints)
    out->viewpoints.push_back((place - out->origin).cast<float>());
  out->horizons = state_->horizons;
  out->make_tiles();
  if (out->sides.empty() && out->viewpoints.empty()) infer_sides(Context::cpu(), *out);
  return MapState::map(std::move(out));
}

PreparedMap prepare_map(const PointCloudView& cloud, const MapOptions& options) {
  MapBuilder builder(options);
  builder.add_cloud(cloud);
  return builder.build();
}

}  // namespace gpureg::localization
