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
  Surface surface{cloud.points(), cloud.normals(), cloud.viewpoints()};
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
  Surface surface = surface_of(prepare(context, cloud, surface_options(registration)));
  // prepare() invents a viewpoint where none is known.
  if (cloud.viewpoint_count == 0) surface.viewpoints.clear();
  return surface;
}

}  // namespace gpureg::reconstruction
