// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <functional>
#include <map>
#include <mutex>
#include <tuple>

#include "gpureg/localization.hpp"
#include "localization/horizon.hpp"
#include "localization/settings.hpp"

namespace gpureg {
class Engine;
class PlanMatcher;
}  // namespace gpureg

namespace gpureg::localization {

/// Sides of surfaces need the direction of a normal only roughly.
using Side = std::array<std::int8_t, 3>;

struct FloorPlan;

/// What a map consists of, and what follows from it.
struct MapState {
  MapOptions given;
  MapSettings options;                  ///< of them
  Eigen::Vector3d origin{0, 0, 0};      ///< of the frame that the rows below are relative to
  std::vector<Eigen::Vector3f> points;  ///< by tile
  std::vector<Side> sides;              ///< empty, or one per point; 0 0 0: not known
  /// Good enough for the search of a place, where both would be tried else, but no evidence.
  bool sides_inferred = false;
  std::vector<Eigen::Vector3f> viewpoints;  ///< sensor positions, thinned
  std::vector<Horizon> horizons;            ///< one per viewpoint

  struct Tile {
    Eigen::AlignedBox3d core;  ///< relative to origin
    std::size_t begin = 0, end = 0;
  };
  std::vector<Tile> tiles;  ///< follow from points and options

  /// Sorts the points by tile; sets tiles.
  void make_tiles();
  /// The points that `keep` accepts of the tiles that meet the box, with sides and viewpoints of
  /// the box.
  PointCloud cut(const Eigen::AlignedBox3d& box,
                 const std::function<bool(const Eigen::Vector3f&)>& keep = {}) const;
  /// A tile with its halo.
  PointCloud tile_cloud(std::size_t tile) const;
  Eigen::AlignedBox3d tile_box(std::size_t tile) const;
  static std::string name_of(std::size_t tile);  ///< in error messages

  /// Number of a new search: tells prepared_tiles() which tiles were used last.
  std::uint64_t begin_search() const;
  /// Prepared tiles, some of them from the cache.
  /// @param prepare the options of the map with another voxel size, 0 for points as they are.
  std::vector<PreparedCloud> prepared_tiles(const Context& context, std::uint64_t search,
                                            const std::vector<std::size_t>& wanted,
                                            const PrepareSettings& prepare) const;

  /// Made when the first scan needs it.
  const FloorPlan& plan(unsigned threads) const;
  /// The plan in the memory of the context's engine.
  std::shared_ptr<PlanMatcher> plan_matcher(const Context& context) const;

  static const MapState& of(const PreparedMap& map);
  static PreparedMap map(std::shared_ptr<const MapState> state) {
    return PreparedMap(std::move(state));
  }

 private:
  /// Backend, voxel size and tile.
  using Key = std::tuple<Backend, float, std::size_t>;
  struct Cached {
    PreparedCloud cloud;
    std::uint64_t search = 0;  ///< that used it last
  };
  void keep(const Key& key, const PreparedCloud& cloud, std::uint64_t search) const;

  mutable std::once_flag planned_;
  mutable std::shared_ptr<const FloorPlan> plan_;
  mutable std::mutex mutex_;
  mutable std::vector<std::pair<std::weak_ptr<Engine>, std::shared_ptr<PlanMatcher>>> matchers_;
  mutable std::map<Key, Cached> cache_;
  mutable std::size_t cached_points_ = 0;
  mutable std::uint64_t searches_ = 0;
};

/// For work on the host: those of the context, or all while a device waits.
unsigned host_threads(const Context& context);

/// Views of clouds that cut() made; a piece of a map was not seen from its origin.
PointCloudView view_of(const PointCloud& cloud);
std::vector<PointCloudView> views_of(const std::vector<PointCloud>& clouds);
/// Settings for points that are means of voxels already.
PrepareSettings as_they_are(PrepareSettings options);

}  // namespace gpureg::localization
