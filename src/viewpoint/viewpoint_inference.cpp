// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/viewpoint_inference.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "spacing/spacing_spread.hpp"
#include "viewpoint/one_return.hpp"

namespace gpureg {
namespace {

// Thresholds: chosen on the clouds of bench/accuracy/viewpoints.py, which measures the decisions.

/// The origin is as good as the best viewpoint up to this factor and this share.
constexpr double kAsGood = 1.5, kContradictionNoise = 4e-4;
/// Largest share of the tried places that may do as well as the origin: where more do (a wall, a
/// convex part), the surfaces do not tell where the sensor was.
constexpr double kMostPlaces = 0.25;
/// Largest radial spread about a scanner, and largest ratio of it to the plain spread.
constexpr double kScannerSpread = 1.6, kSpreadRatio = 0.6;
/// Largest ratio of radial to plain irregularity (spread above 1) at which the spacing speaks for a
/// viewpoint that the surfaces allow.
constexpr double kIrregularityRatio = 0.5;
/// A closed surface: its mean normal and the contradictions along it.
constexpr double kClosedFlux = 0.05, kClosedContradiction = 2e-3;
/// Input normals of a closed surface: those of faces turn at once along its edges, so that thin
/// walls contradict each other a little.
constexpr double kModelContradiction = 0.03;
/// No viewpoint sees all of a surface: least contradictions from the best one, and largest ratio of
/// those along the surface to them. In scans of rooms the ratio is above 0.1: sides that are
/// propagated through clutter contradict little and are wrong for whole objects.
constexpr double kHiddenBack = 1e-2, kAlongRatio = 0.08;
/// Input normals contradict each other: share of the edges, and ratio to that of better sides.
constexpr double kContradictory = 0.04, kBetterSides = 3;
/// Largest share of input normals that are repaired; where more disagree, they may mean something
/// else than sides.
constexpr double kMostRepaired = 1.0 / 3;
/// Fewer edges tell nothing.
constexpr std::size_t kMinEdges = 200;

struct SearchedViewpoint {
  Vec3 place{0, 0, 0};
  double contradiction = 1;
  struct Tried {
    Vec3 place;
    double contradiction;
  };
  std::vector<Tried> tried;  ///< the first places

  void take(Vec3 other, double its_contradiction) {
    if (its_contradiction >= contradiction) return;
    contradiction = its_contradiction;
    place = other;
  }
};

/// Distances of the first places from the points, in radii of neighbours; half the diagonal of the
/// cloud's box is the unit of the others.
constexpr float kFromPoints[] = {2, 4, 10, 24};
constexpr float kFromCentre[] = {0.25f, 0.5f, 0.9f, 1.4f};
constexpr std::uint32_t kStartPoints = 48;

std::vector<Vec3> start_places(const SurfaceGraph& graph, float radius, Vec3 centre, float half) {
  std::vector<Vec3> places{centre};
  const std::vector<Vec3>& points = graph.points();
  for (std::uint32_t k = 0; k < kStartPoints; ++k) {
    const std::size_t i = k * points.size() / kStartPoints;
    const float distance = radius * kFromPoints[k % 4];
    places.push_back(points[i] + graph.normals()[i] * (k % 8 < 4 ? distance : -distance));
  }
  for (const float factor : kFromCentre)
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
          if (x || y || z)
            places.push_back(centre +
                             normalized_or_zero({static_cast<float>(x), static_cast<float>(y),
                                                 static_cast<float>(z)}) *
                                 (half * factor));
  return places;
}

/// The place with the fewest contradictions: the best of the first ones, then a pattern search.
SearchedViewpoint search_viewpoint(const SurfaceGraph& graph, float radius) {
  Vec3 lo{0, 0, 0}, hi{0, 0, 0};
  if (!graph.points().empty()) lo = hi = graph.points().front();
  for (const Vec3& p : graph.points()) {
    lo = {std::min(lo.x, p.x), std::min(lo.y, p.y), std::min(lo.z, p.z)};
    hi = {std::max(hi.x, p.x), std::max(hi.y, p.y), std::max(hi.z, p.z)};
  }
  const float half = 0.5f * norm(hi - lo);
  SearchedViewpoint best;
  std::vector<Vec3> places = start_places(graph, radius, (lo + hi) * 0.5f, half);
  std::vector<double> contradictions = graph.contradictions(places);
  for (std::size_t k = 0; k < places.size(); ++k) {
    best.tried.push_back({places[k], contradictions[k]});
    best.take(places[k], contradictions[k]);
  }
  for (float step = 0.2f * half; step > 0.5f * radius;) {
    const Vec3 from = best.place;
    places.clear();
    for (const Vec3 along : {Vec3{step, 0, 0}, Vec3{0, step, 0}, Vec3{0, 0, step}}) {
      places.push_back(from - along);
      places.push_back(from + along);
    }
    contradictions = graph.contradictions(places);
    for (std::size_t k = 0; k < places.size(); ++k) best.take(places[k], contradictions[k]);
    if (best.place.x == from.x && best.place.y == from.y && best.place.z == from.z) step *= 0.5f;
  }
  return best;
}

/// True where most points show two viewpoints different sides.
bool opposite(const SurfaceGraph& graph, Vec3 a, Vec3 b) {
  const SurfaceGraph::Signs from_a = graph.signs_towards(a), from_b = graph.signs_towards(b);
  std::size_t different = 0;
  for (std::size_t i = 0; i < from_a.size(); ++i) different += from_a[i] != from_b[i];
  return 2 * different > from_a.size();
}

/// True where a viewpoint explains the surfaces, and either the points are spaced as from there, or
/// hardly any other place explains them, least of all one behind them: a range image of a single
/// object looks as plausible from its back.
bool explains(const SurfaceGraph& graph, const SearchedViewpoint& best, Vec3 viewpoint,
              const SpacingSpread& spread) {
  const double limit = kAsGood * best.contradiction + kContradictionNoise;
  if (graph.contradiction(viewpoint) > limit) return false;
  if (spread.radial - 1 <= kIrregularityRatio * (spread.plain - 1)) return true;
  if (opposite(graph, viewpoint, best.place)) return false;
  std::size_t as_good = 0;
  for (const SearchedViewpoint::Tried& tried : best.tried) {
    if (tried.contradiction > limit) continue;
    if (opposite(graph, viewpoint, tried.place)) return false;
    ++as_good;
  }
  return static_cast<double>(as_good) <= kMostPlaces * static_cast<double>(best.tried.size());
}

void flip(SurfaceGraph::Signs& signs) {
  for (std::int8_t& sign : signs) sign = static_cast<std::int8_t>(-sign);
}

bool is_closed(const SurfaceGraph& graph, const SurfaceGraph::Signs& along) {
  return graph.flux(along) <= kClosedFlux && graph.contradiction(along) <= kClosedContradiction;
}

/// Sides from the best viewpoint, or along the surface where no viewpoint sees all of it.
SurfaceGraph::Signs best_sides(const SurfaceGraph& graph, Vec3 best_place,
                               SurfaceGraph::Signs along) {
  SurfaceGraph::Signs seen = graph.signs_towards(best_place);
  const double contradiction = graph.contradiction(seen);
  if (contradiction >= kHiddenBack && graph.contradiction(along) <= kAlongRatio * contradiction)
    return along;
  return seen;
}

bool is_scanner(const SpacingSpread& spread) {
  return spread.radial <= kScannerSpread && spread.radial <= kSpreadRatio * spread.plain;
}

}  // namespace

InferredSides infer_sides(const SurfaceGraph& graph, Vec3 origin, const RawCloud& rows,
                          Vec3 origin_of_rows, bool infer) {
  InferredSides out;
  if (graph.edges() < kMinEdges) {
    if (infer) out.source = ViewpointSource::origin;
    return out;
  }
  const SpacingSpread spread = infer ? spacing_spread(rows, origin_of_rows) : SpacingSpread{};
  if (infer && is_scanner(spread)) {
    out.source = ViewpointSource::origin;
    return out;
  }
  const SearchedViewpoint best = search_viewpoint(graph, graph.radius());
  SurfaceGraph::Signs along = graph.consistent_signs();
  if (is_closed(graph, along)) {
    if (!graph.outwards(along)) flip(along);
    return {ViewpointSource::model, std::move(along), true};
  }
  if (infer && (explains(graph, best, origin, spread) ||
                has_one_return_per_direction(rows, origin_of_rows))) {
    out.source = ViewpointSource::origin;
    return out;
  }
  out.signs = best_sides(graph, best.place, std::move(along));
  out.sign_known = false;
  return out;
}

InferredSides check_given_sides(const SurfaceGraph& graph) {
  InferredSides out{ViewpointSource::normals, {}, true};
  const SurfaceGraph::Signs given(graph.points().size(), 1);
  const double contradiction = graph.contradiction(given);
  if (graph.edges() >= kMinEdges && contradiction <= kModelContradiction &&
      graph.flux(given) <= kClosedFlux && graph.outwards(given))
    out.source = ViewpointSource::model;
  if (graph.edges() < kMinEdges || contradiction < kContradictory) return out;
  const SearchedViewpoint best = search_viewpoint(graph, graph.radius());
  SurfaceGraph::Signs better = best_sides(graph, best.place, graph.consistent_signs());
  if (contradiction < kBetterSides * graph.contradiction(better)) return out;
  std::ptrdiff_t sum = 0;
  for (const std::int8_t sign : better) sum += sign;
  if (sum < 0) flip(better);
  const auto flipped = std::count(better.begin(), better.end(), std::int8_t(-1));
  if (static_cast<double>(flipped) > kMostRepaired * static_cast<double>(better.size())) return out;
  out.signs = std::move(better);
  return out;
}

}  // namespace gpureg
