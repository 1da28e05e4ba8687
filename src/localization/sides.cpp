// SPDX-License-Identifier: BSD-3-Clause
#include "localization/sides.hpp"

#include <cmath>

#include "common/without_features.hpp"
#include "localization/surface.hpp"

namespace gpureg::localization {
namespace {

/// Points of a tile whose surroundings are looked at, and points that they are looked for.
constexpr std::size_t kPlaces = 2000, kAround = 4000;
/// Sine of the angle from a surface below which others lie beside it.
constexpr float kBeside = 0.2f;
/// Share of such places that agree from which a tile's sides are known: it is 0.8 to 0.99 in the
/// maps of bench/notes/maps.md.
constexpr double kClear = 0.75;

/// A tile whose points have normals of consistent sides, either of which may be the seen one.
struct Sided {
  std::vector<std::size_t> index;  ///< of its points that are not stray, in the map
  PreparedCloud cloud;
};

Sided sided(const Context& context, const MapState& map, std::size_t tile) {
  Sided out;
  const PointCloud cloud = map.cut(map.tile_box(tile), [&](const Eigen::Vector3f& p) {
    out.index.push_back(static_cast<std::size_t>(&p - map.points.data()));
    return true;
  });
  PrepareSettings options = as_they_are(map.options.prepare);
  options.depth_maps = 1;
  options.surface_side_distance = 0;
  options.wide_feature_radius = 0;
  const WithoutFeatures without(cloud.points.size());
  const PointCloudView view = without.of(view_of(cloud));
  out.cloud = prepare_batch(context, {view}, options, {map.name_of(tile)}).front();
  const std::vector<std::size_t> kept = kept_rows(view, options);
  for (std::size_t k = 0; k < kept.size(); ++k) out.index[k] = out.index[kept[k]];
  out.index.resize(kept.size());
  return out;
}

/// Of the points that have at least twice as many others on one side as on the other, the share
/// with most of them before their surface; a half if there are none.
double share_before(const std::vector<Eigen::Vector3f>& points,
                    const std::vector<Eigen::Vector3f>& normals, double reach) {
  const auto squared_reach = static_cast<float>(reach * reach);
  std::size_t before = 0, behind = 0;
  for (std::size_t i = 0; i < points.size(); i += points.size() / kPlaces + 1) {
    if (normals[i].squaredNorm() == 0) continue;
    std::size_t before_it = 0, behind_it = 0;
    for (std::size_t j = 0; j < points.size(); j += points.size() / kAround + 1) {
      const Eigen::Vector3f d = points[j] - points[i];
      const float squared = d.squaredNorm(), along = normals[i].dot(d);
      if (squared > squared_reach || along * along < kBeside * kBeside * squared) continue;
      ++(along > 0 ? before_it : behind_it);
    }
    before += before_it > 2 * behind_it;
    behind += behind_it > 2 * before_it;
  }
  const std::size_t all = before + behind;
  return all == 0 ? 0.5 : static_cast<double>(before) / static_cast<double>(all);
}

}  // namespace

Side side_of(const Eigen::Vector3f& normal) {
  constexpr float kScale = 127;
  const Eigen::Vector3f scaled = normal * kScale;
  Side side{};
  for (int k = 0; k < 3; ++k)
    side[static_cast<std::size_t>(k)] = static_cast<std::int8_t>(std::lround(scaled[k]));
  return side;
}

std::vector<Eigen::Vector3f> tile_normals(const Context& context, const MapState& map,
                                          std::size_t tile) {
  const std::size_t begin = map.tiles[tile].begin, end = map.tiles[tile].end;
  std::vector<Eigen::Vector3f> out(end - begin, Eigen::Vector3f::Zero());
  const Sided found = sided(context, map, tile);
  const std::vector<Eigen::Vector3f> normals = found.cloud.normals();
  for (std::size_t k = 0; k < normals.size(); ++k)
    if (found.index[k] >= begin && found.index[k] < end) out[found.index[k] - begin] = normals[k];
  return out;
}

void infer_sides(const Context& context, MapState& map) {
  std::vector<Side> sides(map.points.size(), Side{});
  for (std::size_t tile = 0; tile < map.tiles.size(); ++tile) {
    const Sided found = sided(context, map, tile);
    const std::vector<Eigen::Vector3f> normals = found.cloud.normals();
    const double before = share_before(found.cloud.points(), normals, map.options.halo);
    if (std::max(before, 1 - before) < kClear) continue;
    const float sign = before < 0.5 ? -1.0f : 1.0f;
    for (std::size_t k = 0; k < found.index.size(); ++k) {
      const std::size_t point = found.index[k];
      if (point >= map.tiles[tile].begin && point < map.tiles[tile].end)
        sides[point] = side_of(sign * normals[k]);
    }
  }
  map.sides = std::move(sides);
  map.sides_inferred = true;
}

}  // namespace gpureg::localization
