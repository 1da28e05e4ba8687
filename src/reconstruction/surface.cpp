// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

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
  // Features are of no use here: one constant per point takes their place.
  const std::vector<float> no_features(cloud.size, 0);
  cloud.features = no_features.data();
  cloud.feature_dimension = 1;
  cloud.feature_stride = 1;
  return surface_of(prepare(context, cloud, surface_options(registration)));
}

}  // namespace gpureg::reconstruction
