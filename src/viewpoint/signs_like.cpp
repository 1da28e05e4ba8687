// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/signs_like.hpp"

#include <algorithm>
#include <utility>

#include "algorithm/cell.hpp"

namespace gpureg {
namespace {

/// A surface with known sides, for the sides of a copy of it.
class OrientedSurface {
 public:
  /// @param reach of a point's side, in the unit of the copy.
  OrientedSurface(const PointsAndNormals& surface, const SurfaceGraph::Signs& signs,
                  const float (&origin)[3], double factor, float reach)
      : inverse_(1 / reach) {
    const auto scaled = [&](float x, float of_origin) {
      return static_cast<float>((static_cast<double>(x) + static_cast<double>(of_origin)) * factor);
    };
    for (std::size_t i = 0; i < surface.points.size(); ++i) {
      const Vec3 p = surface.points[i];
      points_.push_back({scaled(p.x, origin[0]), scaled(p.y, origin[1]), scaled(p.z, origin[2])});
      normals_.push_back(surface.normals[i] * static_cast<float>(signs[i]));
      const Cell cell = cell_of(points_.back(), inverse_);
      if (in_key_range(cell)) order_.emplace_back(cell_key(cell), static_cast<std::uint32_t>(i));
    }
    std::sort(order_.begin(), order_.end());
  }

  /// The side that the points around show, 1 without any.
  std::int8_t sign_of(Vec3 point, Vec3 normal) const {
    const Cell at = cell_of(point, inverse_);
    float sum = 0;
    for (std::int32_t z = at.z - 1; z <= at.z + 1; ++z)
      for (std::int32_t y = at.y - 1; y <= at.y + 1; ++y) {
        const Cell first{at.x - 1, y, z}, last{at.x + 1, y, z};
        if (!in_key_range(first) || !in_key_range(last)) continue;
        for (auto k = std::lower_bound(order_.begin(), order_.end(),
                                       std::pair(cell_key(first), std::uint32_t{0}));
             k != order_.end() && k->first <= cell_key(last); ++k) {
          const float closeness =
              1 - squared_norm(points_[k->second] - point) * inverse_ * inverse_;
          if (closeness > 0) sum += closeness * dot(normals_[k->second], normal);
        }
      }
    return sum < 0 ? -1 : 1;
  }

 private:
  std::vector<Vec3> points_, normals_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order_;  ///< by cell
  float inverse_;
};

}  // namespace

SurfaceGraph::Signs signs_like(const PlacedSurface& other, const SurfaceGraph::Signs& signs,
                               const PlacedSurface& copy, double factor, float reach) {
  const OrientedSurface oriented(other.surface, signs, other.origin, factor, reach);
  const auto& [surface, origin] = copy;
  SurfaceGraph::Signs out;
  for (std::size_t i = 0; i < surface.points.size(); ++i)
    out.push_back(oriented.sign_of(surface.points[i] + Vec3{origin[0], origin[1], origin[2]},
                                   surface.normals[i]));
  return out;
}

}  // namespace gpureg
