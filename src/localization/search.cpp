// SPDX-License-Identifier: BSD-3-Clause
#include "localization/search.hpp"

#include <algorithm>
#include <functional>

#include "fields/localization.hpp"
#include "math/trigonometry.hpp"

namespace gpureg::localization {
namespace {

/// Prepared points of the tiles that are aligned together: about 1 GB.
constexpr double kPointsAtOnce = 400'000;
/// Matches of a scan and a tile: a tile has many more matches of its own than the scan has, and a
/// random choice of few holds hardly any of the scan's.
constexpr std::uint32_t kMatches = 65536;
/// Of the coarsest voxels, in voxels of the coarse search.
constexpr double kCoarser = 2;
/// Poses and tiles with less than this share of the odds of the most confident one, and poses with
/// less than this share of even odds, are left out.
constexpr double kHopeless = 0.01, kHopelessAlone = 1e-4;

bool may_be_in(const Scan& scan, const MapState& map, std::size_t tile) {
  if (!scan.prior.position) return true;
  const Eigen::Vector3d place = scan.prior.position->position - map.origin;
  return map.tile_box(tile).exteriorDistance(place) <= scan.prior.position->radius + scan.reach;
}

/// The pair's prior is about the middle of the scan, whose place depends on the attitude.
RegistrationPrior prior_of_pair(const Scan& scan) {
  RegistrationPrior prior;
  prior.gravity = scan.prior.gravity;
  if (const auto& known = scan.prior.position) {
    PosePrior pose;
    pose.target_from_source.translation() = known->position - scan.middle;
    pose.max_rotation = 180;
    pose.max_translation = known->radius + 3 * scan.reach;
    prior.pose = pose;
  }
  return prior;
}

/// One search: in which voxels, and which scans in which tiles.
struct Search {
  RegistrationSettings registration;
  PrepareSettings prepare;  ///< of the tiles
  double factor = 1;        ///< of the voxels
  PreparedCloud Scan::* cloud = &Scan::cloud;
  std::uint64_t number = 0;
  std::function<bool(std::size_t scan, std::size_t tile)> wants;
};

Search search_with(const MapState& map, const LocateSettings& options, double factor,
                   PreparedCloud Scan::* cloud) {
  Search out;
  out.registration = options.registration_at(factor);
  out.registration.compatibility.max_matches = kMatches;
  out.prepare = prepare_for(map, factor);
  out.factor = factor;
  out.cloud = cloud;
  out.number = map.begin_search();
  return out;
}

/// Aligns the scans with the tiles and collects the modes.
void search_tiles(const Context& context, const MapState& map, const Search& search,
                  const std::vector<std::size_t>& tiles, std::vector<Scan>& scans) {
  std::vector<PreparedCloud> clouds =
      map.prepared_tiles(context, search.number, tiles, search.prepare);
  std::vector<Pair> pairs;
  std::vector<RegistrationPrior> priors;
  for (std::size_t k = 0; k < scans.size(); ++k) {
    clouds.push_back(scans[k].*search.cloud);
    for (std::size_t t = 0; t < tiles.size(); ++t) {
      if (!search.wants(k, tiles[t])) continue;
      pairs.push_back(
          {static_cast<std::uint32_t>(tiles.size() + k), static_cast<std::uint32_t>(t)});
      priors.push_back(prior_of_pair(scans[k]));
    }
  }
  const std::vector<RegistrationResult> results =
      align_batch(context, clouds, pairs, search.registration, {}, priors);
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    Scan& scan = scans[pairs[p].source - tiles.size()];
    const std::size_t tile = tiles[pairs[p].target];
    for (std::size_t m = 0; m < results[p].modes.size(); ++m) {
      const RegistrationMode& mode = results[p].modes[m];
      if (contradicts(scan, mode.target_from_source)) continue;
      scan.candidates.push_back({mode.target_from_source, mode.confidence, tile, m});
      scan.best[tile] = std::max(scan.best[tile], mode.confidence);
    }
  }
}

bool is_hopeless(double confidence, double best) {
  return odds_of(confidence) < kHopeless * odds_of(best);
}

void run(const Context& context, const MapState& map, const LocateSettings& options,
         const Search& search, std::vector<Scan>& scans) {
  std::vector<std::size_t> together;
  double points = 0;
  const auto search_those = [&] {
    if (!together.empty()) search_tiles(context, map, search, together, scans);
    together.clear();
    points = 0;
  };
  for (std::size_t tile = 0; tile < map.tiles.size(); ++tile) {
    bool wanted = false;
    for (std::size_t k = 0; k < scans.size(); ++k) wanted |= search.wants(k, tile);
    if (!wanted) continue;
    together.push_back(tile);
    // Of a surface, voxels twice as wide leave a quarter of the points.
    points += static_cast<double>(map.tiles[tile].end - map.tiles[tile].begin) /
              (search.factor * search.factor);
    if (points >= kPointsAtOnce) search_those();
  }
  search_those();
  for (Scan& scan : scans) keep_likely(options, scan);
}

/// Whether each scan is searched in each tile.
using Wanted = std::vector<std::vector<char>>;

std::function<bool(std::size_t, std::size_t)> in(const Wanted& wanted) {
  return [&wanted](std::size_t scan, std::size_t tile) { return wanted[scan][tile] != 0; };
}

/// Of the tiles, the `most` ones that were the most confident, without hopeless ones.
void keep_best(const Scan& scan, std::size_t most, std::vector<char>& tiles) {
  std::vector<std::size_t> order;
  for (std::size_t tile = 0; tile < tiles.size(); ++tile)
    if (tiles[tile] != 0) order.push_back(tile);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return scan.best[a] > scan.best[b]; });
  order.resize(std::min(order.size(), most));
  while (order.size() > 1 && is_hopeless(scan.best[order.back()], scan.best[order.front()]))
    order.pop_back();
  std::fill(tiles.begin(), tiles.end(), 0);
  for (const std::size_t tile : order) tiles[tile] = 1;
}

/// Leaves the tiles that a search in coarser voxels finds the best of a large map.
void search_coarser(const Context& context, const MapState& map, const LocateSettings& options,
                    std::vector<Scan>& scans, Wanted& wanted) {
  Search search = search_with(map, options, kCoarser * options.coarse_factor, &Scan::coarsest);
  std::vector<char> large;
  for (const Scan& scan : scans)
    large.push_back(scan.tiles > options.coarse_tiles && scan.coarsest.size() >= kTellingPoints);
  search.wants = [&](std::size_t k, std::size_t tile) {
    return large[k] != 0 && wanted[k][tile] != 0;
  };
  run(context, map, options, search, scans);
  for (std::size_t k = 0; k < scans.size(); ++k) {
    if (large[k] != 0) keep_best(scans[k], options.coarse_tiles, wanted[k]);
    scans[k].candidates = scans[k].planned;
    scans[k].best.assign(map.tiles.size(), 0);
  }
}

}  // namespace

Scan scan_of(PreparedCloud cloud, const LocatePrior& prior) {
  Scan scan;
  for (const Eigen::Vector3f& point : cloud.points()) {
    scan.points.push_back(point.cast<double>() + cloud.origin());
    scan.middle += scan.points.back();
    scan.reach = std::max(scan.reach, scan.points.back().norm());
  }
  if (!scan.points.empty()) scan.middle /= static_cast<double>(scan.points.size());
  scan.cloud = std::move(cloud);
  scan.prior = prior;
  return scan;
}

void keep_likely(const LocateSettings& options, Scan& scan) {
  std::vector<Candidate>& all = scan.candidates;
  all = distinct(std::move(all), scan.middle, options.registration.evidence, options.candidates);
  const auto is_last_hopeless = [&] {
    return odds_of(all.back().confidence) < kHopelessAlone ||
           is_hopeless(all.back().confidence, all.front().confidence);
  };
  while (all.size() > 1 && is_last_hopeless()) all.pop_back();
}

bool contradicts(const Scan& scan, const UnalignedIsometry3d& map_from_scan) {
  if (const auto& known = scan.prior.position)
    if ((map_from_scan.translation() - known->position).norm() > known->radius) return true;
  if (const auto& gravity = scan.prior.gravity) {
    const Eigen::Vector3d up = map_from_scan.linear() * gravity->source_up.normalized();
    constexpr double kRounding = 1e-6;  // 180 degrees permit every pose
    const double least = portable::cos(gravity->max_angle * portable::kRadiansPerDegree);
    return up.dot(gravity->target_up.normalized()) < least - kRounding;
  }
  return false;
}

PrepareSettings prepare_for(const MapState& map, double factor) {
  if (factor == 1) return as_they_are(map.options.prepare);
  return gpureg::resolve(map.given.prepare, map.given.voxel_size * static_cast<float>(factor));
}

double coarsest_factor(const MapState& map, const LocateSettings& options) {
  return map.tiles.size() > options.coarse_tiles ? kCoarser * options.coarse_factor : 0;
}

void search_all_tiles(const Context& context, const MapState& map, const LocateSettings& options,
                      std::vector<Scan>& scans) {
  Wanted wanted(scans.size(), std::vector<char>(map.tiles.size(), 0));
  for (std::size_t k = 0; k < scans.size(); ++k) {
    scans[k].best.assign(map.tiles.size(), 0);
    for (std::size_t tile = 0; tile < map.tiles.size(); ++tile)
      scans[k].tiles += wanted[k][tile] = may_be_in(scans[k], map, tile);
  }
  if (coarsest_factor(map, options) > 0) search_coarser(context, map, options, scans, wanted);
  Search search = search_with(map, options, options.coarse_factor, &Scan::coarse);
  search.wants = in(wanted);
  run(context, map, options, search, scans);
}

void search_best_tiles(const Context& context, const MapState& map, const LocateSettings& options,
                       const std::vector<std::size_t>& which, std::vector<Scan>& scans) {
  Wanted wanted(scans.size(), std::vector<char>(map.tiles.size(), 0));
  for (const std::size_t k : which) {
    for (std::size_t tile = 0; tile < map.tiles.size(); ++tile)
      wanted[k][tile] = may_be_in(scans[k], map, tile);
    keep_best(scans[k], options.fine_tiles, wanted[k]);
  }
  Search search = search_with(map, options, 1, &Scan::cloud);
  search.wants = in(wanted);
  run(context, map, options, search, scans);
}

}  // namespace gpureg::localization
