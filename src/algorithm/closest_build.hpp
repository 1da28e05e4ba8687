// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/closest.hpp"

namespace gpureg {

/// Geometry of a closest-point grid. All lengths are widened by margin, which covers the rounding
/// of point coordinates and of the division into cells: a candidate too many costs a comparison,
/// one too few a wrong answer.
struct ClosestGeometry {
  float cell_size;
  float search_distance;
  float margin;
};

GPUREG_HD ClosestGeometry closest_geometry(float search_distance, float cloud_radius) {
  const float cell = search_distance / 3.0f;
  // Queries that can still meet a point reach search_distance beyond the cloud.
  return {cell, search_distance, 1e-3f * cell + (cloud_radius + search_distance) * 2e-6f};
}

GPUREG_HD Vec3 cell_center(Cell c, float size) {
  return {(static_cast<float>(c.x) + 0.5f) * size, (static_cast<float>(c.y) + 0.5f) * size,
          (static_cast<float>(c.z) + 0.5f) * size};
}

/// True where point p, at distance d from the cell's centre, can be within the search distance of
/// some place in the cell.
GPUREG_HD bool can_reach_cell(float distance, const ClosestGeometry& g) {
  return distance <= g.search_distance + 0.8660255f * g.cell_size + g.margin;
}

/// True where every place in the cell is closer to p (which is nearest to its centre) than to q,
/// rounding included. The difference of the squared distances is linear over the cell, so its
/// smallest value is at a corner.
GPUREG_HD bool dominated_in_cell(Vec3 center, Vec3 p, Vec3 q, const ClosestGeometry& g) {
  const Vec3 d = q - p;
  const float l1 = (d.x < 0 ? -d.x : d.x) + (d.y < 0 ? -d.y : d.y) + (d.z < 0 ? -d.z : d.z);
  const float at_center = squared_norm(q - center) - squared_norm(p - center);
  return at_center > l1 * (g.cell_size + 2.0f * g.margin) + 8.0f * g.margin * g.margin;
}

/// Edge of a block, how far a point's reach goes, and how far from a block's centre (along an axis)
/// a point can matter to it.
GPUREG_HD float block_edge(const ClosestGeometry& g) {
  return static_cast<float>(ClosestGridView::kBlockEdge) * g.cell_size;
}
GPUREG_HD float point_reach(const ClosestGeometry& g) {
  return g.search_distance + 2.0f * g.margin;
}
GPUREG_HD float block_reach(const ClosestGeometry& g) {
  return 0.5f * block_edge(g) + g.search_distance + 2.0f * g.margin;
}

/// Who is farther from a cell's centre than this is never the closest: nearest is the distance of
/// the point nearest to the centre.
GPUREG_HD float candidate_limit(float nearest, const ClosestGeometry& g) {
  const float half_diagonal = 0.8660255f * g.cell_size;
  const float by_nearest = nearest + 2.0f * half_diagonal,
              by_search = g.search_distance + half_diagonal;
  return (by_search < by_nearest ? by_search : by_nearest) + 2.0f * g.margin;
}

/// False where point p is never the answer in a cell whose centre is nearest to another point,
/// best. after_best: p has the higher index.
GPUREG_HD bool can_win_in_cell(Vec3 center, Vec3 best, Vec3 p, bool after_best,
                               const ClosestGeometry& g) {
  if (dominated_in_cell(center, best, p, g)) return false;
  // Of points in the very same place only the first can win.
  return !(after_best && p.x == best.x && p.y == best.y && p.z == best.z);
}

}  // namespace gpureg
