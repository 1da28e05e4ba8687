// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/closest.hpp"

namespace gpureg {

/// Geometry of a closest-point grid. margin widens all lengths and covers the rounding of
/// coordinates and of the division into cells. A superfluous candidate costs a comparison, a
/// missing one a wrong result.
struct ClosestGeometry {
  float cell_size;
  float search_distance;
  float margin;
};

/// Cells per search distance, along each axis.
constexpr float kCellsPerSearchDistance = 3.0f;
/// Margins: a share of the cell, and the rounding of coordinates of this magnitude in float.
constexpr float kCellMargin = 1e-3f, kCoordinateRounding = 2e-6f;
/// Half the diagonal of a unit cube, rounded up.
constexpr float kHalfDiagonal = 0.8660255f;

GPUREG_HD ClosestGeometry closest_geometry(float search_distance, float cloud_radius) {
  const float cell = search_distance / kCellsPerSearchDistance;
  // Queries within search_distance of the cloud can have a nearest neighbour.
  return {cell, search_distance,
          kCellMargin * cell + (cloud_radius + search_distance) * kCoordinateRounding};
}

GPUREG_HD Vec3 cell_center(Cell c, float size) {
  return {(static_cast<float>(c.x) + 0.5f) * size, (static_cast<float>(c.y) + 0.5f) * size,
          (static_cast<float>(c.z) + 0.5f) * size};
}

/// True where a point at this distance from the centre of a cell is within the search distance of
/// some location in the cell.
GPUREG_HD bool can_reach_cell(float distance, const ClosestGeometry& g) {
  return distance <= g.search_distance + kHalfDiagonal * g.cell_size + g.margin;
}

/// Constants of the test below.
struct DominanceTest {
  float edge, rest;
};
GPUREG_HD DominanceTest dominance_test(const ClosestGeometry& g) {
  return {g.cell_size + 2.0f * g.margin, 8.0f * g.margin * g.margin};
}

/// True where every location in a cell is closer to p (the point nearest to its centre) than to q,
/// rounding included. The difference of the squared distances is linear over the cell, so its
/// minimum is at a corner. d: q - p; at_center: this difference at the centre.
GPUREG_HD bool dominated(Vec3 d, float at_center, const DominanceTest& test) {
  const float l1 = (d.x < 0 ? -d.x : d.x) + (d.y < 0 ? -d.y : d.y) + (d.z < 0 ? -d.z : d.z);
  return at_center > l1 * test.edge + test.rest;
}
GPUREG_HD bool dominated_in_cell(Vec3 center, Vec3 p, Vec3 q, const ClosestGeometry& g) {
  return dominated(q - p, squared_norm(q - center) - squared_norm(p - center), dominance_test(g));
}

/// Edge of a block; search distance of a point with margins; largest distance from the centre of a
/// block, along an axis, at which a point matters to it.
GPUREG_HD float block_edge(const ClosestGeometry& g) {
  return static_cast<float>(ClosestGridView::kBlockEdge) * g.cell_size;
}
GPUREG_HD float point_reach(const ClosestGeometry& g) {
  return g.search_distance + 2.0f * g.margin;
}
GPUREG_HD float block_reach(const ClosestGeometry& g) {
  return 0.5f * block_edge(g) + g.search_distance + 2.0f * g.margin;
}

/// Upper bound on the distance from the centre of a cell at which a point can still be the nearest
/// neighbour of a location in the cell. nearest: distance of the point nearest to the centre.
GPUREG_HD float candidate_limit(float nearest, const ClosestGeometry& g) {
  const float half_diagonal = kHalfDiagonal * g.cell_size;
  const float by_nearest = nearest + 2.0f * half_diagonal,
              by_search = g.search_distance + half_diagonal;
  return (by_search < by_nearest ? by_search : by_nearest) + 2.0f * g.margin;
}

GPUREG_HD bool coincide(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/// False where point p is the nearest neighbour of no location in a cell. best: the point nearest
/// to the centre of the cell. after_best: p has the higher index.
GPUREG_HD bool can_win_in_cell(Vec3 center, Vec3 best, Vec3 p, bool after_best,
                               const ClosestGeometry& g) {
  if (dominated_in_cell(center, best, p, g)) return false;
  // Of coincident points only the first one is ever found.
  return !(after_best && coincide(p, best));
}

}  // namespace gpureg
