// SPDX-License-Identifier: BSD-3-Clause
#include "common/without_features.hpp"
#include "gpureg/reconstruction.hpp"

namespace gpureg::reconstruction {

PrepareOptions surface_options(PrepareOptions registration) {
  registration.voxel_size /= 2;
  registration.depth_maps = 0;
  registration.surface_side_distance = 0;
  return registration;
}

Surface surface_of(const PreparedCloud& cloud) {
  Surface surface{cloud.points(), cloud.normals()};
  // prepare() takes the origin for the viewpoint where none is given.
  if (cloud.statistics().viewpoint == ViewpointSource::said)
    surface.viewpoints = cloud.viewpoints();
  const Eigen::Vector3f origin = cloud.origin().cast<float>();
  for (Eigen::Vector3f& point : surface.points) point += origin;
  for (Eigen::Vector3f& viewpoint : surface.viewpoints) viewpoint += origin;
  return surface;
}

Surface surface_of(const Context& context, PointCloudView cloud,
                   const PrepareOptions& registration) {
  const WithoutFeatures without(cloud.size);
  return surface_of(prepare(context, without.of(cloud), surface_options(registration)));
}

}  // namespace gpureg::reconstruction
