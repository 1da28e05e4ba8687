// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/change.hpp"

#include <algorithm>
#include <cmath>

#include "common/without_features.hpp"
#include "fields/in_units.hpp"
#include "fields/localization.hpp"
#include "localization/candidates.hpp"
#include "localization/change/changed_points.hpp"
#include "localization/check_scan.hpp"
#include "localization/surface.hpp"
#include "math/trigonometry.hpp"

namespace gpureg::localization {
namespace {

/// Distance from the points of the scan up to which the map takes part in the refinement, voxels.
constexpr double kNeighborhoodVoxels = 20;

/// A scan and the map around it, in one frame: that of the map, less `middle`.
struct Scene {
  UnalignedIsometry3d map_from_scan = no_pose();
  double inlier_ratio = 0;
  Eigen::Vector3d middle{0, 0, 0};
  Surface scan, map;
  std::vector<std::size_t> numbers;  ///< of the map's discs in the map
};

std::vector<Eigen::Vector3d> in_frame(const PointCloud& cloud) {
  std::vector<Eigen::Vector3d> out;
  for (const Eigen::Vector3f& p : cloud.points) out.push_back(p.cast<double>() + cloud.origin);
  return out;
}

/// Refines the pose, as verify_poses() does, and takes the share of inliers.
void refine(const Context& context, const PointCloudView& scan, const MapState& map,
            const PointCloud& surface, bool move, Scene& scene) {
  const double voxel = static_cast<double>(map.options.prepare.voxel_size);
  const PointCloud around =
      neighborhood(map, in_frame(surface), scene.map_from_scan, kNeighborhoodVoxels * voxel);
  if (around.points.empty()) return;
  const RegistrationSettings options = gpureg::resolve(RegistrationOptions{map.given.voxel_size});
  const PreparedCloud source = prepare(context, scan, map.options.prepare),
                      target = prepare(context, views_of({around}).front(),
                                       as_they_are(map.options.prepare));
  VerificationOptions verification;
  verification.refine = move;
  verification.search_alternatives = false;
  const PoseVerification verified =
      verify_poses(context, source, target, {scene.map_from_scan}, options, verification).front();
  scene.inlier_ratio = verified.inlier_ratio;
  if (move) scene.map_from_scan = verified.target_from_source;
}

/// At most `most` of the numbers below `size`, evenly over their order.
std::vector<std::size_t> spread(std::size_t size, std::size_t most) {
  std::vector<std::size_t> out;
  const std::size_t count = std::min(size, most);
  for (std::size_t k = 0; k < count; ++k) out.push_back(k * size / count);
  return out;
}

/// Positions of a hand-held camera are many and close together: one of each cell.
std::vector<Eigen::Vector3f> thinned(const std::vector<Eigen::Vector3f>& positions, float cell) {
  std::vector<Eigen::Vector3f> out;
  for (const Eigen::Vector3f& p : positions)
    if (std::none_of(out.begin(), out.end(),
                     [&](const Eigen::Vector3f& q) { return (p - q).norm() < cell; }))
      out.push_back(p);
  return out;
}

void place_scan(const PointCloud& surface, const ChangeOptions& options, float voxel,
                Scene& scene) {
  const auto local = [&](const Eigen::Vector3f& p) -> Eigen::Vector3f {
    const Eigen::Vector3d in_map =
        scene.map_from_scan * (p.cast<double>() + surface.origin) - scene.middle;
    return in_map.cast<float>();
  };
  const Eigen::Matrix3f turn = scene.map_from_scan.linear().cast<float>();
  for (const Eigen::Vector3f& p : surface.points) scene.scan.points.push_back(local(p));
  for (const Eigen::Vector3f& n : surface.normals) scene.scan.normals.push_back(turn * n);
  scene.scan.normals.resize(scene.scan.points.size(), Eigen::Vector3f::Zero());
  for (const Eigen::Vector3f& p : surface.viewpoints) scene.scan.viewpoints.push_back(local(p));
  const std::vector<Eigen::Vector3f> positions = thinned(scene.scan.viewpoints, 5 * voxel);
  scene.scan.viewpoints.clear();
  for (const std::size_t k : spread(positions.size(), options.viewpoints))
    scene.scan.viewpoints.push_back(positions[k]);
  scene.scan.spacing = voxel / 2;
}

/// The points of the map within half of the scan's extent from it, and sensor positions there.
void cut_map(const MapState& map, const ChangeOptions& options, Scene& scene) {
  Eigen::AlignedBox3d box;
  for (const auto* rows : {&scene.scan.points, &scene.scan.viewpoints})
    for (const Eigen::Vector3f& p : *rows) box.extend(p.cast<double>());
  const double voxel = static_cast<double>(map.options.prepare.voxel_size);
  const double margin = std::max(box.sizes().maxCoeff() / 2, kNeighborhoodVoxels * voxel);
  box.min().array() -= margin;
  box.max().array() += margin;
  const Eigen::Vector3d shift = map.origin - scene.middle;
  const auto take = [&](const Eigen::Vector3f& p, std::vector<Eigen::Vector3f>& into) {
    const Eigen::Vector3d local = p.cast<double>() + shift;
    if (!box.contains(local)) return false;
    into.push_back(local.cast<float>());
    return true;
  };
  for (std::size_t k = 0; k < map.points.size(); ++k) {
    if (!take(map.points[k], scene.map.points)) continue;
    scene.numbers.push_back(k);
    const Side side = map.sides.empty() ? Side{} : map.sides[k];
    const Eigen::Vector3f normal = Eigen::Vector3i(side[0], side[1], side[2]).cast<float>();
    scene.map.normals.push_back(side == Side{} ? normal : normal.normalized());
  }
  std::vector<std::size_t> from;
  std::vector<Eigen::Vector3f> positions;
  for (std::size_t k = 0; k < map.viewpoints.size(); ++k)
    if (take(map.viewpoints[k], positions)) from.push_back(k);
  for (const std::size_t k : spread(from.size(), options.viewpoints)) {
    scene.map.viewpoints.push_back(positions[k]);
    scene.map.horizons.push_back(map.horizons[from[k]]);
  }
  if (from.empty()) scene.map.viewpoints = scene.scan.viewpoints;
  scene.map.spacing = map.options.prepare.voxel_size;
  scene.map.horizon_step = horizon_step(map.options.prepare.voxel_size);
}

/// Normals of a map that came without any; their signs do not matter.
void estimate_normals(const Context& context, const MapState& map, Surface& surface) {
  if ((!map.sides.empty() && !map.sides_inferred) || surface.points.empty()) return;
  const WithoutFeatures without(surface.points.size());
  PointCloudView view = without.of(PointCloudView(surface.points));
  view.infer_viewpoint = false;
  PrepareSettings options = as_they_are(map.options.prepare);
  options.depth_maps = 0;
  options.surface_side_distance = 0;
  options.wide_feature_radius = 0;
  const std::vector<Eigen::Vector3f> normals = prepare(context, view, options).normals();
  const std::vector<std::size_t> kept = kept_rows(view, options);
  surface.normals.assign(surface.points.size(), Eigen::Vector3f::Zero());
  for (std::size_t k = 0; k < kept.size(); ++k) surface.normals[kept[k]] = normals[k];
}

/// The tolerance of points, more where an uncertain turn moves them more.
std::vector<float> tolerances(const std::vector<Eigen::Vector3f>& points,
                              const Eigen::Vector3f& pivot, const ChangeOptions& options) {
  std::vector<float> out;
  for (const Eigen::Vector3f& p : points) {
    const double arm = static_cast<double>((p - pivot).norm()) * options.rotation_sigma *
                       portable::kRadiansPerDegree;
    const double sigma =
        std::sqrt(options.translation_sigma * options.translation_sigma + arm * arm);
    out.push_back(static_cast<float>(options.tolerance + 2 * sigma));
  }
  return out;
}

Scene scene_of(const Context& context, const PointCloudView& scan, const MapState& map,
               const UnalignedIsometry3d& map_from_scan, const ChangeOptions& options) {
  Scene scene;
  scene.map_from_scan = map_from_scan;
  const PointCloud surface = seen_surface(context, scan, map.options.prepare);
  if (surface.points.empty()) return scene;
  refine(context, scan, map, surface, options.refine, scene);
  scene.middle = scene.map_from_scan * (surface.points.front().cast<double>() + surface.origin);
  place_scan(surface, options, map.options.prepare.voxel_size, scene);
  cut_map(map, options, scene);
  estimate_normals(context, map, scene.map);
  return scene;
}

/// The points of a view that are finite in the frame of the scene; others stay away.
std::vector<std::size_t> place_points(const PointCloudView& scan, const Scene& scene,
                                      std::vector<Eigen::Vector3f>& out) {
  std::vector<std::size_t> numbers;
  const Eigen::Vector3d origin(scan.origin[0], scan.origin[1], scan.origin[2]);
  for (std::size_t k = 0; k < scan.size; ++k) {
    const Eigen::Map<const Eigen::Vector3f> p(scan.points + k * scan.point_stride);
    if (!p.allFinite()) continue;
    const Eigen::Vector3d in_map = scene.map_from_scan * (p.cast<double>() + origin);
    const Eigen::Vector3f in_scene = (in_map - scene.middle).cast<float>();
    if (!in_scene.allFinite()) continue;
    out.push_back(in_scene);
    numbers.push_back(k);
  }
  return numbers;
}

/// Labels of all points of a cloud of which some were asked about.
PointChanges all_of(const PointChanges& asked, const std::vector<std::size_t>& numbers,
                    std::size_t size, float probability) {
  PointChanges out;
  out.labels.assign(size, ChangeLabel::not_observed);
  out.probabilities.assign(size, probability);
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    out.labels[numbers[k]] = asked.labels[k];
    out.probabilities[numbers[k]] = asked.probabilities[k];
  }
  return out;
}

}  // namespace

std::size_t PointChanges::count(ChangeLabel label) const {
  return static_cast<std::size_t>(std::count(labels.begin(), labels.end(), label));
}

const char* to_string(ChangeLabel label) {
  switch (label) {
    case ChangeLabel::same:
      return "same";
    case ChangeLabel::appeared:
      return "new";
    case ChangeLabel::gone:
      return "gone";
    case ChangeLabel::occluded:
      return "occluded";
    case ChangeLabel::not_observed:
      return "not_observed";
  }
  return "unknown";
}

ChangeResult find_changes(const Context& context, const PointCloudView& scan,
                          const PreparedMap& map, const UnalignedIsometry3d& map_from_scan,
                          const ChangeOptions& given) {
  const MapState& state = MapState::of(map);
  given.validate();
  const ChangeOptions options = fields::in_units(given, state.given.voxel_size);
  scan.validate();
  check_place(map_from_scan);
  check_unit(scan, state, "scan");
  const Scene scene = scene_of(context, scan, state, map_from_scan, options);
  ChangeResult out;
  out.map_from_scan = scene.map_from_scan;
  out.inlier_ratio = scene.inlier_ratio;
  const Eigen::Vector3f pivot =
      scene.scan.viewpoints.empty() ? Eigen::Vector3f::Zero() : scene.scan.viewpoints.front();
  Question of_scan, of_map;
  of_scan.spacing = of_map.spacing = state.options.prepare.voxel_size;
  const std::vector<std::size_t> numbers = place_points(scan, scene, of_scan.points);
  of_scan.tolerances = tolerances(of_scan.points, pivot, options);
  out.scan = all_of(changed_points(of_scan, scene.map, options.min_extent, host_threads(context)),
                    numbers, scan.size, 0);
  of_map.points = scene.map.points;
  of_map.tolerances = tolerances(of_map.points, pivot, options);
  of_map.changed = ChangeLabel::gone;
  out.map = all_of(changed_points(of_map, scene.scan, options.min_extent, host_threads(context)),
                   scene.numbers, state.points.size(), 1);
  return out;
}

}  // namespace gpureg::localization
