// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cell.hpp"

namespace gpureg {

/// View of points sorted into cells (stable: ascending index within a cell), for fixed-radius
/// neighbourhoods.
struct GridView {
  float cell_size;
  float inverse_cell_size;
  Span<const CellEntry> table;           ///< cell key -> index of the cell
  Span<const std::uint32_t> cell_start;  ///< cells + 1 offsets into points and index
  Span<const Vec3> points;               ///< sorted by cell
  Span<const std::uint32_t> index;       ///< of the sorted points in the cloud
};

/// Factor that covers the rounding of a ball's corners into cells.
constexpr float kBallMargin = 1.0001f;

/// Calls visit(index, point, squared_distance) for every point within radius of q, q itself
/// included, in cell order: z, y, x, then index. The order is part of the contract, because the
/// sums over neighbours are floating point.
template <typename Visit>
GPUREG_HD void for_each_neighbor(const GridView& grid, Vec3 q, float radius, Visit&& visit) {
  const float r2 = radius * radius;
  // Slightly more than the radius: the rounding of p * inverse must not lose a neighbour at the
  // border of a cell.
  const float reach = radius * kBallMargin;
  const Cell lo = cell_of({q.x - reach, q.y - reach, q.z - reach}, grid.inverse_cell_size);
  const Cell hi = cell_of({q.x + reach, q.y + reach, q.z + reach}, grid.inverse_cell_size);
  for (std::int32_t z = lo.z; z <= hi.z; ++z)
    for (std::int32_t y = lo.y; y <= hi.y; ++y)
      for (std::int32_t x = lo.x; x <= hi.x; ++x) {
        const std::uint32_t cell = find_cell(grid.table, cell_key({x, y, z}));
        if (cell == kNoValue) continue;
        const std::uint32_t end = grid.cell_start[cell + 1];
        for (std::uint32_t k = grid.cell_start[cell]; k < end; ++k) {
          const Vec3 p = grid.points[k];
          const float d2 = squared_norm(p - q);
          if (d2 <= r2) visit(grid.index[k], p, d2);
        }
      }
}

}  // namespace gpureg
