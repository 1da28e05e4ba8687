// SPDX-License-Identifier: BSD-3-Clause
#include "localization/find/part_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/for_each_on.hpp"

namespace gpureg::localization {
namespace {

/// Grazing views tell nothing: cosine of the largest angle between normal and direction.
constexpr float kLeastCosine = 0.3f;
/// Cells of a depth image in spacings, and depths in cells within which a point is in front. A
/// surface at the largest angle falls by three cells within one.
constexpr float kCell = 1.5f, kFront = 2.5f;
/// Cells along the longest side of the depth image that finds the outer surface.
constexpr float kOuterCells = 80;

struct Basis {
  Eigen::Vector3f x, y, z;
};

Basis basis_of(const Eigen::Vector3f& z) {
  int axis = 0;
  z.cwiseAbs().minCoeff(&axis);
  const Eigen::Vector3f x = z.cross(Eigen::Vector3f::Unit(axis)).normalized();
  return {x, z.cross(x), z};
}

/// Marks the points that are seen from a direction (towards the viewer).
void look(const std::vector<Eigen::Vector3f>& points, const std::vector<Eigen::Vector3f>& normals,
          float cell, const Eigen::Vector3f& direction, std::vector<char>& seen) {
  const Basis basis = basis_of(direction);
  Eigen::AlignedBox2f box;
  std::vector<Eigen::Vector2f> at(points.size());
  for (std::size_t k = 0; k < points.size(); ++k)
    box.extend(at[k] = {basis.x.dot(points[k]), basis.y.dot(points[k])});
  const float inverse = 1 / cell;
  const auto width = static_cast<std::size_t>(box.sizes().x() * inverse) + 1,
             height = static_cast<std::size_t>(box.sizes().y() * inverse) + 1;
  std::vector<float> front(width * height, -std::numeric_limits<float>::infinity());
  const auto cell_at = [&](const Eigen::Vector2f& p) {
    const Eigen::Vector2f q = (p - box.min()) * inverse;
    return static_cast<std::size_t>(q.y()) * width + static_cast<std::size_t>(q.x());
  };
  for (std::size_t k = 0; k < points.size(); ++k) {
    float& f = front[cell_at(at[k])];
    f = std::max(f, basis.z.dot(points[k]));
  }
  for (std::size_t k = 0; k < points.size(); ++k) {
    const float turned = normals.empty() ? 1 : normals[k].dot(direction);
    seen[k] =
        turned >= kLeastCosine && basis.z.dot(points[k]) >= front[cell_at(at[k])] - kFront * cell;
  }
}

}  // namespace

const std::vector<Eigen::Vector3f>& look_directions() {
  static const std::vector<Eigen::Vector3f> all = [] {
    std::vector<Eigen::Vector3f> out;
    for (int x = -2; x <= 2; ++x)
      for (int y = -2; y <= 2; ++y)
        for (int z = -2; z <= 2; ++z) {
          const int squared = x * x + y * y + z * z, most = std::max({x * x, y * y, z * z});
          const bool of_cube = most == 1, between = squared == 6;
          if (of_cube || between)
            out.push_back(Eigen::Vector3i(x, y, z).cast<float>().normalized());
        }
    return out;
  }();
  return all;
}

std::vector<std::uint64_t> directions_that_see(const std::vector<Eigen::Vector3f>& points,
                                               const std::vector<Eigen::Vector3f>& normals,
                                               float spacing, unsigned threads) {
  const std::vector<Eigen::Vector3f>& directions = look_directions();
  std::vector<std::vector<char>> seen(directions.size(), std::vector<char>(points.size(), 0));
  for_each_on(threads, directions.size(), [&](std::size_t d) {
    look(points, normals, kCell * spacing, directions[d], seen[d]);
  });
  std::vector<std::uint64_t> out(points.size(), 0);
  for (std::size_t d = 0; d < directions.size(); ++d)
    for (std::size_t k = 0; k < points.size(); ++k)
      if (seen[d][k] != 0) out[k] |= std::uint64_t{1} << d;
  return out;
}

PointCloud outer_surface(const PointCloudView& part, unsigned threads) {
  PointCloud all;
  for (int k = 0; k < 3; ++k) all.origin[k] = part.origin[k];
  all.model = part.model;
  Eigen::AlignedBox3f box;
  for (std::size_t k = 0; k < part.size; ++k) {
    const Eigen::Map<const Eigen::Vector3f> p(part.points + k * part.point_stride);
    if (!p.allFinite()) continue;
    all.points.emplace_back(p);
    box.extend(all.points.back());
    if (part.normals == nullptr) continue;
    const Eigen::Map<const Eigen::Vector3f> n(part.normals + k * part.normal_stride);
    all.normals.push_back(n.allFinite() ? Eigen::Vector3f(n.normalized())
                                        : Eigen::Vector3f::Zero());
  }
  for (std::size_t k = 0; k < part.viewpoint_count; ++k)
    all.viewpoints.emplace_back(Eigen::Map<const Eigen::Vector3f>(part.viewpoints + 3 * k));
  if (!part.model || all.points.empty()) return all;
  const float cell = std::max(box.sizes().maxCoeff() / kOuterCells, 1e-30f);
  // Normals of a mesh may be turned inwards here and there: only what hides a point counts.
  const std::vector<std::uint64_t> seen =
      directions_that_see(all.points, {}, cell / kCell, threads);
  PointCloud out = all;
  out.points.clear();
  out.normals.clear();
  for (std::size_t k = 0; k < all.points.size(); ++k) {
    if (seen[k] == 0) continue;
    out.points.push_back(all.points[k]);
    if (!all.normals.empty()) out.normals.push_back(all.normals[k]);
  }
  return out;
}

}  // namespace gpureg::localization
