// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <set>

#include "gpureg/reconstruction.hpp"
#include "localization/check_scan.hpp"

namespace gpureg::localization {
namespace {

/// Sensor positions closer together than this number of voxels see the same.
constexpr double kViewpointVoxels = 10;

Side side_of(const Eigen::Vector3f& normal) {
  constexpr float kScale = 127;
  const Eigen::Vector3f scaled = normal * kScale;
  Side side{};
  for (int k = 0; k < 3; ++k)
    side[static_cast<std::size_t>(k)] = static_cast<std::int8_t>(std::lround(scaled[k]));
  return side;
}

void check_pose(const UnalignedIsometry3d& pose) {
  const Eigen::Matrix3d r = pose.linear();
  // A float pose has errors of 1e-6; more than 1e-3 is a scale, a shear or a mirror image.
  constexpr double kTolerance = 1e-3;
  if (!pose.matrix().allFinite() ||
      (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kTolerance ||
      r.determinant() < 0)
    throw InvalidArgument("map_from_scan is no rigid motion");
}

/// For the sides of surfaces: points of half a voxel, no features.
PrepareOptions side_options(PrepareOptions options) {
  options.voxel_size /= 2;
  options.depth_maps = 1;
  options.surface_side_distance = 0;
  options.wide_feature_radius = 0;
  return options;
}

}  // namespace

struct MapBuilder::State {
  explicit State(const MapOptions& of) : options(of), cells(of.prepare.voxel_size) {}

  void add_viewpoint(const Eigen::Vector3d& place) {
    const Eigen::Array3d cell =
        (place / (kViewpointVoxels * static_cast<double>(options.prepare.voxel_size)))
            .array()
            .floor();
    if (seen.insert({cell[0], cell[1], cell[2]}).second) viewpoints.push_back(place);
  }

  MapOptions options;
  reconstruction::VoxelMap cells;
  std::vector<Eigen::Vector3d> viewpoints;
  std::set<std::array<double, 3>> seen;
};

MapBuilder::MapBuilder(const MapOptions& options) {
  options.validate();
  state_ = std::make_unique<State>(options);
}
MapBuilder::~MapBuilder() = default;
MapBuilder::MapBuilder(MapBuilder&&) noexcept = default;
MapBuilder& MapBuilder::operator=(MapBuilder&&) noexcept = default;

void MapBuilder::add_scan(const Context& context, const PointCloudView& scan,
                          const UnalignedIsometry3d& map_from_scan) {
  check_pose(map_from_scan);
  PointCloudView plain = scan;
  const std::vector<float> no_features(scan.size, 0);  // one constant per point takes their place
  plain.features = no_features.data();
  plain.feature_dimension = plain.feature_stride = 1;
  const PreparedCloud prepared = prepare(context, plain, side_options(state_->options.prepare));
  PointCloud moved;
  moved.points = prepared.points();
  moved.origin = prepared.origin();
  const ViewpointSource source = prepared.statistics().viewpoint;
  if (source != ViewpointSource::none) moved.normals = prepared.normals();
  state_->cells.add(moved.view(), map_from_scan);
  if (source == ViewpointSource::said || source == ViewpointSource::origin)
    for (const Eigen::Vector3f& place : prepared.viewpoints())
      state_->add_viewpoint(map_from_scan * (place.cast<double>() + moved.origin));
}

void MapBuilder::add_cloud(const PointCloudView& cloud) {
  state_->cells.add(cloud, UnalignedIsometry3d::Identity());
  const Eigen::Vector3d origin(cloud.origin[0], cloud.origin[1], cloud.origin[2]);
  for (std::size_t k = 0; k < cloud.viewpoint_count; ++k)
    state_->add_viewpoint(
        Eigen::Map<const Eigen::Vector3f>(cloud.viewpoints + 3 * k).cast<double>() + origin);
}

PreparedMap MapBuilder::build() const {
  PointCloud cloud = state_->cells.cloud();
  if (cloud.points.empty()) throw InvalidArgument("the map has no points");
  check_map(cloud, state_->options);
  auto out = std::make_shared<MapState>();
  out->options = state_->options;
  out->origin = cloud.origin;
  out->points = std::move(cloud.points);
  for (const Eigen::Vector3f& normal : cloud.normals) out->sides.push_back(side_of(normal));
  for (const Eigen::Vector3d& place : state_->viewpoints)
    out->viewpoints.push_back((place - out->origin).cast<float>());
  out->make_tiles();
  return MapState::map(std::move(out));
}

PreparedMap prepare_map(const PointCloudView& cloud, const MapOptions& options) {
  MapBuilder builder(options);
  builder.add_cloud(cloud);
  return builder.build();
}

}  // namespace gpureg::localization
