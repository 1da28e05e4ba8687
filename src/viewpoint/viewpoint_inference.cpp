// SPDX-License-Identifier: BSD-3-Clause
#include "viewpoint/viewpoint_inference.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "viewpoint/contradictions.hpp"
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
  /// The first places; where the contradiction is above as_good(), it may be infinite.
  std::vector<Tried> tried;
  /// Contradiction up to which a place explains the surfaces as well.
  double as_good() const { return kAsGood * contradiction + kContradictionNoise; }

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

/// Places that a step of a pattern search compares.
constexpr std::size_t kPlacesOfStep = 6;

void add_places_of_step(Vec3 from, float step, std::vector<Vec3>& places) {
  for (const Vec3 along : {Vec3{step, 0, 0}, Vec3{0, step, 0}, Vec3{0, 0, step}}) {
    places.push_back(from - along);
    places.push_back(from + along);
  }
}

bool same_place(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

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
  const std::vector<Vec3> starts = start_places(graph, radius, (lo + hi) * 0.5f, half);
  // The first places bound what matters about the others. Those after them are compared in
  // parallel.
  const std::size_t some = std::min(viewpoints_at_once(), starts.size());
  for (std::size_t begin = 0, end = some; begin < starts.size(); begin = end, end = starts.size()) {
    const std::vector<Vec3> places(starts.begin() + static_cast<std::ptrdiff_t>(begin),
                                   starts.begin() + static_cast<std::ptrdiff_t>(end));
    const std::vector<double> contradictions = graph.contradictions(places, best.as_good());
    for (std::size_t k = 0; k < places.size(); ++k) {
      best.tried.push_back({places[k], contradictions[k]});
      best.take(places[k], contradictions[k]);
    }
  }
  // Where there is room for it, the next smaller step is tried at the same time.
  const bool both = viewpoints_at_once() >= 2 * kPlacesOfStep;
  for (float step = 0.2f * half; step > 0.5f * radius;) {
    const Vec3 from = best.place;
    std::vector<Vec3> places;
    add_places_of_step(from, step, places);
    if (both && 0.5f * step > 0.5f * radius) add_places_of_step(from, 0.5f * step, places);
    const std::vector<double> contradictions = graph.contradictions(places, best.contradiction);
    for (std::size_t first = 0; first < places.size() && same_place(best.place, from);
         first += kPlacesOfStep) {
      for (std::size_t k = first; k < first + kPlacesOfStep; ++k)
        best.take(places[k], contradictions[k]);
      if (!same_place(best.place, from)) break;
      step *= 0.5f;
    }
  }
  return best;
}

/// True where most points show a viewpoint other sides than these.
bool opposite(const SurfaceGraph& graph, const SurfaceGraph::Signs& sides, Vec3 viewpoint) {
  const SurfaceGraph::Signs others = graph.signs_towards(viewpoint);
  std::size_t different = 0;
  for (std::size_t i = 0; i < sides.size(); ++i) different += sides[i] != others[i];
  return 2 * different > sides.size();
}

/// True where a viewpoint explains the surfaces, and either the points are spaced as from there, or
/// hardly any other place explains them, least of all one behind them: a range image of a single
/// object looks as plausible from its back.
bool explains(const SurfaceGraph& graph, const SearchedViewpoint& best, Vec3 viewpoint,
              const SpacingSpread& spread) {
  const double limit = best.as_good();
  if (graph.contradiction(viewpoint) > limit) return false;
  if (spread.radial - 1 <= kIrregularityRatio * (spread.plain - 1)) return true;
  const SurfaceGraph::Signs sides = graph.signs_towards(viewpoint);
  if (opposite(graph, sides, best.place)) return false;
  std::size_t as_good = 0;
  for (const SearchedViewpoint::Tried& tried : best.tried) {
    if (tried.contradiction > limit) continue;
    if (opposite(graph, sides, tried.place)) return false;
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

/// The best viewpoint and the sides along the surface.
struct BothSides {
  SearchedViewpoint best;
  SurfaceGraph::Signs along;

  explicit BothSides(const SurfaceGraph& graph) {
    graph.threads().parallel(2, [&](std::size_t k) {
      if (k == 0) best = search_viewpoint(graph, graph.radius());
      if (k == 1) along = graph.consistent_signs();
    });
  }
};

}  // namespace

bool is_scanner(const SpacingSpread& spread) {
  return spread.radial <= kScannerSpread && spread.radial <= kSpreadRatio * spread.plain;
}

InferredSides infer_sides(const SurfaceGraph& graph, Vec3 origin, const RawCloud& rows,
                          Vec3 origin_of_rows, const SpacingSpread* spread, bool may_be_model) {
  InferredSides out;
  if (graph.edges() < kMinEdges || (spread && is_scanner(*spread))) {
    if (spread) out.source = ViewpointSource::origin;
    return out;
  }
  auto [best, along] = BothSides(graph);
  if (may_be_model && is_closed(graph, along)) {
    if (!graph.outwards(along)) flip(along);
    return {ViewpointSource::model, std::move(along), true};
  }
  if (spread && (explains(graph, best, origin, *spread) ||
                 has_one_return_per_direction(rows, origin_of_rows))) {
    out.source = ViewpointSource::origin;
    return out;
  }
  out.signs = best_sides(graph, best.place, std::move(along));
  out.sign_known = false;
  return out;
}

InferredSides check_given_sides(const SurfaceGraph& graph, bool may_be_model) {
  InferredSides out{ViewpointSource::normals, {}, true};
  const SurfaceGraph::Signs given(graph.points().size(), 1);
  const double contradiction = graph.contradiction(given);
  if (may_be_model && graph.edges() >= kMinEdges && contradiction <= kModelContradiction &&
      graph.flux(given) <= kClosedFlux && graph.outwards(given))
    out.source = ViewpointSource::model;
  if (graph.edges() < kMinEdges || contradiction < kContradictory) return out;
  auto [best, along] = BothSides(graph);
  SurfaceGraph::Signs better = best_sides(graph, best.place, std::move(along));
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
