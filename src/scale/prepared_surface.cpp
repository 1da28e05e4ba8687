// SPDX-License-Identifier: BSD-3-Clause
#include "scale/prepared_surface.hpp"

#include <utility>

#include "api/access.hpp"
#include "api/frames.hpp"
#include "pipeline/prepared_state.hpp"

namespace gpureg::scale {
namespace {

ClosestSurface surface_of(const PreparedCloud& cloud, float distance) {
  PointsAndNormals points = Access::state(cloud)->copy_points_and_normals();
  return {std::move(points.points), std::move(points.normals), distance};
}

}  // namespace

PreparedSurface::PreparedSurface(const PreparedCloud& cloud, float distance)
    : cloud_(cloud), surface_(surface_of(cloud, distance)) {}

RefinedScale refine_scale(const PreparedSurface& source, const PreparedSurface& target,
                          const UnalignedIsometry3d& target_from_source, float kernel) {
  const PreparedState &s = *Access::state(source.cloud()), &t = *Access::state(target.cloud());
  const Pose<double> local = local_from_rows(rows_from_frames(target_from_source, s, t), s, t);
  UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(local.w, local.x, local.y, local.z).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(local.tx, local.ty, local.tz);
  return refine_scale(source.surface(), target.surface(), pose, kernel);
}

}  // namespace gpureg::scale
