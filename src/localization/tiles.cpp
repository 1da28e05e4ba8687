// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/radix_sort.hpp"
#include "localization/map_state.hpp"

namespace gpureg::localization {
namespace {

/// Tiles along an axis; far stray points cost empty tiles only, which are not kept.
constexpr int kTileBits = 20;
constexpr std::uint64_t kMostTiles = 1 << kTileBits;
/// Prepared points that a map keeps: about 3 GB. The least recently used ones make room.
constexpr std::size_t kMostCachedPoints = 1'000'000;

std::int64_t count_of(double extent, const MapSettings& options) {
  const double inner = extent - 2 * options.halo;
  return static_cast<std::int64_t>(
      std::clamp(std::ceil(inner / options.tile_size), 1.0, static_cast<double>(kMostTiles)));
}

}  // namespace

void MapState::make_tiles() {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& p : points) box.extend(p.cast<double>());
  std::array<std::int64_t, 3> count{};
  Eigen::Vector3d edge = box.sizes();
  for (int axis = 0; axis < 3; ++axis) {
    count[static_cast<std::size_t>(axis)] = count_of(box.sizes()[axis], options);
    edge[axis] /= static_cast<double>(count[static_cast<std::size_t>(axis)]);
  }
  // Cells in the order of x, y, z.
  const auto cell_of = [&](const Eigen::Vector3f& p) {
    std::uint64_t cell = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double at = static_cast<double>(p[axis]) - box.min()[axis];
      const std::int64_t last = count[static_cast<std::size_t>(axis)] - 1;
      const auto k = edge[axis] > 0 ? static_cast<std::int64_t>(std::floor(at / edge[axis])) : 0;
      cell = cell << kTileBits | static_cast<std::uint64_t>(std::clamp<std::int64_t>(k, 0, last));
    }
    return cell;
  };
  std::vector<KeyIndex> order(points.size());
  for (std::size_t k = 0; k < points.size(); ++k)
    order[k] = {cell_of(points[k]), static_cast<std::uint32_t>(k)};
  // Those of a file are in this order.
  const auto before = [](const KeyIndex& a, const KeyIndex& b) { return a.key < b.key; };
  if (!std::is_sorted(order.begin(), order.end(), before)) {
    radix_sort(order);
    std::vector<Eigen::Vector3f> sorted_points(points.size());
    std::vector<Side> sorted_sides(sides.size());
    for (std::size_t k = 0; k < order.size(); ++k) sorted_points[k] = points[order[k].index];
    for (std::size_t k = 0; k < sides.size(); ++k) sorted_sides[k] = sides[order[k].index];
    points = std::move(sorted_points);
    sides = std::move(sorted_sides);
  }
  tiles.clear();
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::uint64_t cell = order[k].key;
    if (k == 0 || cell != order[k - 1].key) {
      Eigen::Vector3d at;
      for (int axis = 0; axis < 3; ++axis)
        at[axis] = static_cast<double>(cell >> (2 - axis) * kTileBits & (kMostTiles - 1));
      const Eigen::Vector3d corner = box.min() + edge.cwiseProduct(at);
      tiles.push_back({Eigen::AlignedBox3d(corner, corner + edge), k, k});
    }
    tiles.back().end = k + 1;
  }
}

Eigen::AlignedBox3d MapState::tile_box(std::size_t tile) const {
  const Eigen::Vector3d halo = Eigen::Vector3d::Constant(options.halo);
  return {tiles[tile].core.min() - halo, tiles[tile].core.max() + halo};
}

PointCloud MapState::cut(const Eigen::AlignedBox3d& box,
                         const std::function<bool(const Eigen::Vector3f&)>& keep) const {
  PointCloud out;
  out.origin = origin;
  // The last point of a row of tiles may lie on its very end, an ulp outside of the core.
  const double slack = static_cast<double>(options.prepare.voxel_size);
  const Eigen::AlignedBox3d reach(box.min().array() - slack, box.max().array() + slack);
  bool has_sides = false;
  for (const Tile& tile : tiles) {
    if (!reach.intersects(tile.core)) continue;
    for (std::size_t k = tile.begin; k < tile.end; ++k) {
      if (!box.contains(points[k].cast<double>()) || (keep && !keep(points[k]))) continue;
      out.points.push_back(points[k]);
      if (sides.empty()) continue;
      const Side& side = sides[k];
      out.normals.push_back(Eigen::Vector3i(side[0], side[1], side[2]).cast<float>());
      has_sides |= side != Side{};
    }
  }
  if (!has_sides) out.normals.clear();
  for (const Eigen::Vector3f& place : viewpoints)
    if (box.contains(place.cast<double>())) out.viewpoints.push_back(place);
  return out;
}

PointCloud MapState::tile_cloud(std::size_t tile) const { return cut(tile_box(tile)); }

std::string MapState::name_of(std::size_t tile) {
  return "tile " + std::to_string(tile) + " of the map";
}

PrepareSettings as_they_are(PrepareSettings options) {
  options.voxel_size = 0;
  options.keep_range_limits = true;  // the scans have left theirs out
  return options;
}

PointCloudView view_of(const PointCloud& cloud) {
  PointCloudView view = cloud.view();
  view.infer_viewpoint = !cloud.viewpoints.empty();
  return view;
}

std::vector<PointCloudView> views_of(const std::vector<PointCloud>& clouds) {
  std::vector<PointCloudView> views;
  for (const PointCloud& cloud : clouds) views.push_back(view_of(cloud));
  return views;
}

std::uint64_t MapState::begin_search() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return ++searches_;
}

/// A search goes through all tiles in one order, so it does not replace tiles of its own. Points as
/// they are belong to the few tiles of a second search; they do not replace what every search
/// needs.
void MapState::keep(const Key& key, const PreparedCloud& cloud, std::uint64_t search) const {
  const auto is_first = [](const Key& k) { return std::get<float>(k) > 0; };
  while (cached_points_ + cloud.size() > kMostCachedPoints) {
    auto oldest = cache_.end();
    for (auto k = cache_.begin(); k != cache_.end(); ++k)
      if (k->second.search < search && (is_first(key) || !is_first(k->first)) &&
          (oldest == cache_.end() || k->second.search < oldest->second.search))
        oldest = k;
    if (oldest == cache_.end()) return;
    cached_points_ -= oldest->second.cloud.size();
    cache_.erase(oldest);
  }
  if (cache_.emplace(key, Cached{cloud, search}).second) cached_points_ += cloud.size();
}

std::vector<PreparedCloud> MapState::prepared_tiles(const Context& context, std::uint64_t search,
                                                    const std::vector<std::size_t>& wanted,
                                                    const PrepareSettings& prepare) const {
  const auto key = [&](std::size_t tile) {
    return std::tuple(context.backend(), prepare.voxel_size, tile);
  };
  std::vector<PreparedCloud> out(wanted.size());
  std::vector<std::size_t> missing;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      const auto found = cache_.find(key(wanted[k]));
      if (found == cache_.end()) {
        missing.push_back(k);
        continue;
      }
      out[k] = found->second.cloud;
      found->second.search = std::max(found->second.search, search);
    }
  }
  if (missing.empty()) return out;
  std::vector<PointCloud> clouds;
  std::vector<std::string> names;
  for (const std::size_t k : missing) {
    clouds.push_back(tile_cloud(wanted[k]));
    names.push_back(name_of(wanted[k]));
  }
  const std::vector<PreparedCloud> prepared =
      prepare_batch(context, views_of(clouds), prepare, names);
  const std::lock_guard<std::mutex> lock(mutex_);
  for (std::size_t m = 0; m < missing.size(); ++m) {
    out[missing[m]] = prepared[m];
    keep(key(wanted[missing[m]]), prepared[m], search);
  }
  return out;
}

}  // namespace gpureg::localization
