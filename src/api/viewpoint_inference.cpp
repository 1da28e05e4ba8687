// SPDX-License-Identifier: BSD-3-Clause
#include "api/viewpoint_inference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

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
/// Rows whose spacing is measured.
constexpr std::size_t kSpacingSample = 1000;
/// Rows of which directions are compared, and those of them whose neighbours are searched.
constexpr std::size_t kDirections = 8000, kDirectionSample = 1500;
/// Neighbours in direction are on different surfaces from this ratio of their ranges on.
constexpr float kOtherSurface = 1.16f;
/// Distance of the places that a viewpoint is compared with, in median ranges.
constexpr float kBeside = 0.3f;
/// Largest mean of the directions of the points: they surround a spinning scanner. From a place far
/// outside of a cloud all ranges are alike.
constexpr float kLargestMeanDirection = 0.5f;
/// Least share of neighbours on different surfaces as seen from those places (fewer tell nothing),
/// and the largest ratio of the viewpoint's share to it. Measured on LiDAR, thinned or not, rooms,
/// objects and parts: no cloud that was moved is below both.
constexpr double kLeastBehind = 0.05, kBehindRatio = 0.55;

struct SearchedViewpoint {
  Vec3 place{0, 0, 0};
  double contradiction = 1;
  struct Tried {
    Vec3 place;
    double contradiction;
  };
  std::vector<Tried> tried;  ///< the first places
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
  for (const Vec3& place : start_places(graph, radius, (lo + hi) * 0.5f, half)) {
    best.tried.push_back({place, graph.contradiction(place)});
    if (best.tried.back().contradiction >= best.contradiction) continue;
    best.contradiction = best.tried.back().contradiction;
    best.place = place;
  }
  for (float step = 0.2f * half; step > 0.5f * radius;) {
    const Vec3 from = best.place;
    for (int axis = 0; axis < 3; ++axis)
      for (const float sign : {-1.0f, 1.0f}) {
        const float d = step * sign;
        const Vec3 place = from + Vec3{axis == 0 ? d : 0, axis == 1 ? d : 0, axis == 2 ? d : 0};
        const double contradiction = graph.contradiction(place);
        if (contradiction >= best.contradiction) continue;
        best.contradiction = contradiction;
        best.place = place;
      }
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

std::vector<Vec3> finite_rows(const RawCloud& rows) {
  std::vector<Vec3> out;
  for (std::size_t i = 0; i < rows.size; ++i) {
    const float* p = rows.points + i * rows.point_stride;
    if (all_finite({p[0], p[1], p[2]})) out.push_back({p[0], p[1], p[2]});
  }
  return out;
}

double quartile_ratio(std::vector<double> values) {
  if (values.size() < 4) return 1;
  std::sort(values.begin(), values.end());
  return values[values.size() * 3 / 4] / values[values.size() / 4];
}

/// Share of neighbours in direction that are on different surfaces, as seen from a place.
double share_behind(const std::vector<Vec3>& points, Vec3 place) {
  struct Ray {
    Vec3 direction;
    float range;
  };
  std::vector<Ray> rays;
  for (const Vec3& p : points)
    if (const float range = norm(p - place); range > 0)
      rays.push_back({(p - place) * (1 / range), range});
  std::sort(rays.begin(), rays.end(), [](const Ray& a, const Ray& b) {
    const Vec3 &p = a.direction, &q = b.direction;
    if (p.x != q.x) return p.x < q.x;
    if (p.y != q.y) return p.y < q.y;
    return p.z != q.z ? p.z < q.z : a.range < b.range;
  });
  const std::size_t count = std::min(kDirectionSample, rays.size());
  std::size_t behind = 0;
  for (std::size_t s = 0; s < count; ++s) {
    const std::size_t at = s * rays.size() / count;
    float nearest = std::numeric_limits<float>::infinity();  // squared
    std::size_t neighbor = at;
    const auto visit = [&](std::size_t k) {
      const Vec3 d = rays[k].direction - rays[at].direction;
      if (d.x * d.x >= nearest) return false;
      if (squared_norm(d) < nearest) {
        nearest = squared_norm(d);
        neighbor = k;
      }
      return true;
    };
    for (std::size_t k = at + 1; k < rays.size() && visit(k);) ++k;
    for (std::size_t k = at; k > 0 && visit(k - 1);) --k;
    const float a = rays[at].range, b = rays[neighbor].range;
    behind += std::max(a, b) > kOtherSurface * std::min(a, b);
  }
  return static_cast<double>(behind) / static_cast<double>(std::max<std::size_t>(count, 1));
}

/// A scanner has one return in each direction: neighbours in direction are on one surface more
/// often about its position than about places beside it. Holds for thinned scans, too.
bool has_one_return_per_direction(const RawCloud& rows, Vec3 viewpoint) {
  const std::vector<Vec3> all = finite_rows(rows);
  std::vector<Vec3> points;
  const std::size_t count = std::min(kDirections, all.size());
  for (std::size_t s = 0; s < count; ++s) points.push_back(all[s * all.size() / count]);
  if (points.empty()) return false;
  std::vector<float> ranges;
  Vec3 sum{0, 0, 0};
  for (const Vec3& p : points) {
    ranges.push_back(norm(p - viewpoint));
    sum = sum + normalized_or_zero(p - viewpoint);
  }
  if (!(norm(sum) <= kLargestMeanDirection * static_cast<float>(points.size()))) return false;
  const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
  std::nth_element(ranges.begin(), middle, ranges.end());
  std::vector<double> beside;
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x)
        if (const int length = x * x + y * y + z * z; length == 1 || length == 3) {
          const Vec3 side = normalized_or_zero(
              {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
          beside.push_back(share_behind(points, viewpoint + side * (kBeside * *middle)));
        }
  const auto typical = beside.begin() + static_cast<std::ptrdiff_t>(beside.size() / 2);
  std::nth_element(beside.begin(), typical, beside.end());
  return *typical >= kLeastBehind && share_behind(points, viewpoint) <= kBehindRatio * *typical;
}

}  // namespace

SpacingSpread spacing_spread(const RawCloud& rows, Vec3 viewpoint) {
  std::vector<Vec3> sorted = finite_rows(rows);
  // Sorted along one axis, a neighbour nearer than d is less than d away in the order, too.
  std::sort(sorted.begin(), sorted.end(), [](const Vec3& a, const Vec3& b) {
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
  });
  std::vector<double> plain, radial;
  for (std::size_t s = 0; s < std::min(kSpacingSample, sorted.size()); ++s) {
    const std::size_t at = s * sorted.size() / std::min(kSpacingSample, sorted.size());
    float nearest = std::numeric_limits<float>::infinity();  // squared
    const auto visit = [&](std::size_t k) {
      const Vec3 d = sorted[k] - sorted[at];
      if (d.x * d.x >= nearest) return false;
      const float squared = squared_norm(d);
      if (squared > 0) nearest = std::min(nearest, squared);
      return true;
    };
    for (std::size_t k = at + 1; k < sorted.size() && visit(k);) ++k;
    for (std::size_t k = at; k > 0 && visit(k - 1);) --k;
    const float range = norm(sorted[at] - viewpoint);
    if (!(range > 0) || nearest == std::numeric_limits<float>::infinity()) continue;
    plain.push_back(static_cast<double>(sqrtf(nearest)));
    radial.push_back(plain.back() / static_cast<double>(range));
  }
  return {quartile_ratio(std::move(plain)), quartile_ratio(std::move(radial))};
}

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
