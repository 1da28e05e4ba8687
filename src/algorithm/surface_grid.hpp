// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cell.hpp"

/// Search for the closest point of a surface whose normal agrees: a hash of cells a little wider
/// than the search distance, so that a point has its neighbours in 27 cells.
namespace gpureg {

/// Points and normals of a scan. Rows of three floats; variances: one per point, at least 1.
struct SurfaceArrays {
  const float* points;
  const float* normals;
  const float* variances;
  std::uint32_t size;
  std::uint32_t usable;  ///< number of points that usable() accepts
  Vec3 low, high;        ///< box of these points
  Vec3 centre;           ///< of the box
  float radius;          ///< of the box, > 0
};

/// A point in the order of the cells, and what belongs to it.
struct alignas(16) SurfacePoint {
  Vec3 position;
  std::uint32_t index;
};
struct alignas(16) SurfaceNormal {
  Vec3 direction;
  float variance;
};

/// Entry of an open-addressing table: the points of a cell.
struct SurfaceCell {
  std::uint64_t key;
  std::uint32_t first, last;
};

struct SurfaceGridView {
  float inverse_cell_size;
  Vec3 corner;     ///< cells are counted from here
  Vec3 low, high;  ///< box of the points that may have a neighbour
  Span<const SurfaceCell> table;
  const SurfacePoint* points;
  const SurfaceNormal* normals;
};

/// Width of a cell over the search distance. The excess covers the rounding of positions up to
/// 80,000 cells from the corner.
constexpr float kSurfaceCellWidth = 1.01f, kSurfaceCellMargin = 0.01f;

GPUREG_HD Vec3 row_of(const float* rows, std::uint32_t i) {
  const float* row = rows + std::size_t(3) * i;
  return {row[0], row[1], row[2]};
}

/// Whether a point takes part: it is finite, near enough, and has a normal of unit length.
GPUREG_HD bool usable(Vec3 point, Vec3 normal) {
  // Squares of coordinates stay finite.
  constexpr float kFarthest = 1e15f;
  const float n = squared_norm(normal);
  return fabsf(point.x) <= kFarthest && fabsf(point.y) <= kFarthest &&
         fabsf(point.z) <= kFarthest && n > 0.25f && n < 1.1f;
}

/// View of a grid without its arrays.
GPUREG_HD SurfaceGridView surface_grid_of(const SurfaceArrays& surface, float distance) {
  const Vec3 reach{distance, distance, distance};
  SurfaceGridView grid{};
  grid.inverse_cell_size = 1.0f / (kSurfaceCellWidth * distance);
  grid.low = grid.corner = surface.low - reach;
  grid.high = surface.high + reach;
  return grid;
}

/// Position in cells. Beyond the range of keys, points share the cells at the border: distances
/// still decide.
GPUREG_HD Vec3 in_cells(const SurfaceGridView& grid, Vec3 p) {
  constexpr float kLast = static_cast<float>(kCellBias - 2);
  const Vec3 v = (p - grid.corner) * grid.inverse_cell_size;
  return {fminf(v.x, kLast), fminf(v.y, kLast), fminf(v.z, kLast)};
}

GPUREG_HD Cell surface_cell(const SurfaceGridView& grid, Vec3 p) {
  const Vec3 v = in_cells(grid, p);
  return {floor_to_int(v.x), floor_to_int(v.y), floor_to_int(v.z)};
}

/// Points of a cell; none: last = 0.
GPUREG_HD SurfaceCell find_surface_cell(Span<const SurfaceCell> table, std::uint64_t key) {
  const std::uint32_t mask = static_cast<std::uint32_t>(table.size) - 1;
  for (std::uint32_t slot = cell_slot(key, mask);; slot = (slot + 1) & mask) {
    const SurfaceCell cell = table.data[slot];
    if (cell.key == key) return cell;
    if (cell.key == kEmptyKey) return {key, 0, 0};
  }
}

/// Neighbour 0, 1, 2 of a cell along an axis: itself, then the next and the previous one.
GPUREG_HD std::int32_t neighbor_step(std::int32_t k) { return k == 2 ? -1 : k; }

/// Least distance, in cells, from a location at `share` of its cell to a neighbour of the cell.
GPUREG_HD float gap_to(std::int32_t step, float share) {
  if (step == 0) return 0.0f;
  return fmaxf((step < 0 ? share : 1.0f - share) - kSurfaceCellMargin, 0.0f);
}

/// Closest point within the distance (inclusive) whose normal makes a cosine of at least min_cosine
/// with the given one; the lower index among equally close ones. Returns its position in the order
/// of the cells, or kNoValue.
GPUREG_HD std::uint32_t closest_on_surface(const SurfaceGridView& grid, Vec3 p, Vec3 normal,
                                           float distance, float min_cosine) {
  if (!(p.x >= grid.low.x && p.y >= grid.low.y && p.z >= grid.low.z && p.x <= grid.high.x &&
        p.y <= grid.high.y && p.z <= grid.high.z))
    return kNoValue;
  const Vec3 at = in_cells(grid, p);
  const Cell centre{floor_to_int(at.x), floor_to_int(at.y), floor_to_int(at.z)};
  const Vec3 share{at.x - static_cast<float>(centre.x), at.y - static_cast<float>(centre.y),
                   at.z - static_cast<float>(centre.z)};
  const float width = kSurfaceCellWidth * distance, squared_width = width * width;
  float least = distance * distance;
  std::uint32_t best = kNoValue, best_index = kNoValue;
  for (std::int32_t kz = 0; kz < 3; ++kz) {
    const std::int32_t dz = neighbor_step(kz);
    const float gz = gap_to(dz, share.z);
    for (std::int32_t ky = 0; ky < 3; ++ky) {
      const std::int32_t dy = neighbor_step(ky);
      const float gy = gap_to(dy, share.y), gyz = gz * gz + gy * gy;
      if (gyz * squared_width > least) continue;
      for (std::int32_t kx = 0; kx < 3; ++kx) {
        const std::int32_t dx = neighbor_step(kx);
        const float gx = gap_to(dx, share.x);
        if ((gyz + gx * gx) * squared_width > least) continue;
        const SurfaceCell cell =
            find_surface_cell(grid.table, cell_key({centre.x + dx, centre.y + dy, centre.z + dz}));
        for (std::uint32_t k = cell.first; k < cell.last; ++k) {
          const SurfacePoint point = grid.points[k];
          const float squared = squared_norm(point.position - p);
          if (squared > least || (squared == least && point.index >= best_index)) continue;
          if (dot(grid.normals[k].direction, normal) < min_cosine) continue;
          least = squared;
          best = k;
          best_index = point.index;
        }
      }
    }
  }
  return best;
}

}  // namespace gpureg
