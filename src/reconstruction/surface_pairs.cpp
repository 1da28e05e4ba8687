// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/surface_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gpureg::reconstruction {

std::vector<float> relative_variances(const Surface& surface, double noise_range) {
  std::vector<float> out(surface.points.size(), 1.0f);
  if (surface.viewpoints.empty() || !std::isfinite(noise_range)) return out;
  const auto scale = static_cast<float>(1 / (noise_range * noise_range));
  for (std::size_t k = 0; k < out.size(); ++k) {
    float least = std::numeric_limits<float>::infinity();
    for (const Eigen::Vector3f& viewpoint : surface.viewpoints)
      least = std::min(least, (surface.points[k] - viewpoint).squaredNorm());
    const float ratio = least * scale;  // of squared distances: of standard deviations
    out[k] = std::max(1.0f, ratio * ratio);
  }
  return out;
}

SurfaceSums surface_sums(const Surface& source, const std::vector<float>& source_variances,
                         const SurfaceGrid& grid, const Surface& target,
                         const std::vector<float>& target_variances,
                         const pose_graph::Pose& target_from_source,
                         const Association& association) {
  SurfaceSums sums;
  const std::size_t size = source.points.size();
  const std::size_t step = (size + association.max_points - 1) / association.max_points;
  // One chosen point stands for all that it was chosen from.
  const double information = association.point_information * static_cast<double>(step);
  const double kernel = association.kernel_width * association.kernel_width;
  const Eigen::Matrix3f turn = target_from_source.rotation.cast<float>();
  const Eigen::Vector3f shift = target_from_source.translation.cast<float>();
  for (std::size_t k = 0; k < size; k += step) {
    const Eigen::Vector3f p = turn * source.points[k] + shift;
    if (!grid.may_reach(p) || source.normals[k].squaredNorm() < 0.25f) continue;
    const std::uint32_t found = grid.closest(p, turn * source.normals[k], association.min_cosine);
    if (found == SurfaceGrid::kNone) continue;
    const Eigen::Vector3d y = p.cast<double>(), n = target.normals[found].cast<double>();
    const double residual = n.dot(y - target.points[found].cast<double>());
    const double ratio = kernel / (kernel + residual * residual);  // Geman and McClure 1985
    const double variance = 0.5 * (static_cast<double>(source_variances[k]) +
                                   static_cast<double>(target_variances[found]));
    const double weight = information / variance * ratio * ratio;
    pose_graph::Vector6d jacobian;
    jacobian.head<3>() = y.cross(n);
    jacobian.tail<3>() = n;
    sums.information.selfadjointView<Eigen::Lower>().rankUpdate(jacobian, weight);
    sums.gradient += weight * residual * jacobian;
    ++sums.count;
    sums.squared_distance += residual * residual;
  }
  sums.information = sums.information.selfadjointView<Eigen::Lower>();
  return sums;
}

}  // namespace gpureg::reconstruction
