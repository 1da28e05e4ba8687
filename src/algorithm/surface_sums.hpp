// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/icp.hpp"
#include "algorithm/surface_grid.hpp"

namespace gpureg {

/// A surface that is compared with another one, at a pose.
struct SurfacePairInput {
  std::uint32_t source, target;
  Rigid target_from_source;
};

/// How correspondences are found and weighed.
struct SurfaceTerms {
  float max_distance;
  float kernel_width;
  float min_cosine;
  std::uint32_t max_points;
};

/// Sums over the correspondences of a pair, about the moved centre of the source. Integers: the
/// same bits in any order.
struct SurfaceSums {
  IcpSums equations;
  std::int64_t squared;  ///< of the residuals, as the sums of the equations
  std::int64_t count;
};
constexpr int kSurfaceSums = 29;
static_assert(sizeof(SurfaceSums) == kSurfaceSums * sizeof(std::int64_t), "an array of sums");

/// Points that the fixed-point sums hold, see kIcpFixedScale.
constexpr std::uint32_t kMaxSurfaceTerms = 1u << 22;

/// Every how many points one looks for a correspondence.
GPUREG_HD std::uint32_t surface_step(std::uint32_t size, std::uint32_t max_points) {
  const std::uint32_t most = max_points < kMaxSurfaceTerms ? max_points : kMaxSurfaceTerms;
  return size <= most ? 1u : (size - 1) / most + 1;
}

/// One correspondence as add_icp_term() takes it.
struct SurfaceCorrespondence {
  Vec3 arm, normal;
  float residual, weight;
};

/// The correspondence of a source point; false without one. Chen and Medioni 1992 (point to plane);
/// Geman and McClure 1985 (kernel). The weight falls with the mean variance of the two points.
GPUREG_HD bool surface_correspondence(const SurfaceArrays& source, const SurfaceGridView& target,
                                      const Rigid& target_from_source, const SurfaceTerms& terms,
                                      std::uint32_t i, SurfaceCorrespondence& out) {
  const Vec3 point = row_of(source.points, i), normal = row_of(source.normals, i);
  if (!usable(point, normal)) return false;
  const Vec3 p = apply(target_from_source, point);
  const std::uint32_t found = closest_on_surface(target, p, rotate(target_from_source, normal),
                                                 terms.max_distance, terms.min_cosine);
  if (found == kNoValue) return false;
  const SurfaceNormal n = target.normals[found];
  const float residual = dot(p - target.points[found].position, n.direction);
  out.arm = (p - apply(target_from_source, source.centre)) * (1.0f / source.radius);
  out.normal = n.direction;
  out.residual = residual * (1.0f / terms.max_distance);
  out.weight =
      robust_weight(residual, terms.kernel_width) / (0.5f * (source.variances[i] + n.variance));
  return true;
}

}  // namespace gpureg
