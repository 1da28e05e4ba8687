// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "common/without_features.hpp"
#include "flat/extruded.hpp"
#include "flat/scan_plane.hpp"
#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {
namespace {

/// Keeps the layer that is the scan itself, exactly in its plane, and normals in it: surfaces then
/// move a scan in its plane only.
void keep_scan(const ScanPlane& plane, double voxel_size, Surface& surface) {
  const Eigen::Vector3d n(plane.normal[0], plane.normal[1], plane.normal[2]);
  Surface out;
  for (std::size_t k = 0; k < surface.points.size(); ++k) {
    const Eigen::Vector3d p = surface.points[k].cast<double>(),
                          normal = surface.normals[k].cast<double>();
    const double height = n.dot(p) - plane.offset;
    if (std::abs(height) > 0.5 * voxel_size) continue;
    const Eigen::Vector3d level = normal - n.dot(normal) * n;
    out.points.push_back((p - height * n).cast<float>());
    out.normals.push_back(level.norm() > 0 ? Eigen::Vector3f(level.normalized().cast<float>())
                                           : Eigen::Vector3f::Zero());
  }
  out.viewpoints = std::move(surface.viewpoints);
  surface = std::move(out);
}

/// Relative to the cloud's origin.
Surface rows_of(const PreparedCloud& cloud) {
  Surface surface{cloud.points(), cloud.normals()};
  // prepare() takes the origin for the viewpoint where none is given.
  if (cloud.statistics().viewpoint == ViewpointSource::given)
    surface.viewpoints = cloud.viewpoints();
  return surface;
}

Surface in_frame(Surface surface, const Eigen::Vector3d& cloud_origin) {
  const Eigen::Vector3f origin = cloud_origin.cast<float>();
  for (Eigen::Vector3f& point : surface.points) point += origin;
  for (Eigen::Vector3f& viewpoint : surface.viewpoints) viewpoint += origin;
  return surface;
}

}  // namespace

RegistrationOptions surface_options(RegistrationOptions registration) {
  PrepareOptions& prepare = registration.prepare;
  registration.voxel_size /= 2;
  for (float* length : {&prepare.normal_radius, &prepare.feature_radius,
                        &prepare.wide_feature_radius, &prepare.max_correspondence_distance})
    *length *= 2;  // of these voxels: as long as before
  prepare.depth_maps = 0;
  prepare.surface_side_distance = 0;
  return registration;
}

Surface surface_of(const PreparedCloud& cloud) { return in_frame(rows_of(cloud), cloud.origin()); }

Surface surface_of(const Context& context, PointCloudView cloud,
                   const RegistrationOptions& registration) {
  const WithoutFeatures without(cloud.size);
  const PreparedCloud prepared = prepare(context, without.of(cloud), surface_options(registration));
  Surface surface = rows_of(prepared);
  if (prepared.statistics().flat) {
    const auto plane = find_scan_plane(cloud.points, cloud.size, cloud.point_stride);
    if (plane) keep_scan(*plane, layer_distance(prepared.settings()), surface);
  }
  return in_frame(std::move(surface), prepared.origin());
}

}  // namespace gpureg::reconstruction
