// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cell.hpp"

namespace gpureg {

/// View of a closest-point grid: cells of a third of the search distance, and for each cell the
/// list of all points that are the nearest neighbour of some location in it. (LoopSmart keeps one
/// point per cell, which loses neighbours.) Cells come in blocks of 8 x 8 x 8, only near the
/// surface.
struct ClosestGridView {
  static constexpr int kBlockEdge = 8;
  static constexpr int kBlockCells = kBlockEdge * kBlockEdge * kBlockEdge;
  float inverse_cell_size;
  Span<const CellEntry> table;           ///< block key -> block
  Span<const std::uint32_t> cell_start;  ///< blocks x (512 + 1) offsets into candidates
  Span<const std::uint32_t> candidates;  ///< point indices, ascending within a cell
};

struct Closest {
  std::uint32_t index;  ///< kNoValue: no point within the distance
  float squared_distance;
};

/// Closest of the candidates first to last (exclusive), see find_closest.
GPUREG_HD Closest closest_candidate(const std::uint32_t* candidates, std::uint32_t first,
                                    std::uint32_t last, const Vec3* points, Vec3 q,
                                    float max_squared) {
  // No branch on the distance: processors cannot predict the winner. Candidates ascend, so "less"
  // keeps the lower index among equals.
  Closest best{kNoValue, 3.402823466e38f};
  for (std::uint32_t k = first; k < last; ++k) {
    const std::uint32_t i = candidates[k];
    const float d2 = squared_norm(points[i] - q);
    const bool less = d2 < best.squared_distance;
    best.index = less ? i : best.index;
    best.squared_distance = less ? d2 : best.squared_distance;
  }
  return best.squared_distance <= max_squared ? best : Closest{kNoValue, max_squared};
}

/// Closest point of the cloud to q within max_squared (inclusive); the lower index wins a tie.
/// Equals an exhaustive search over squared_norm(points[k] - q) as long as max_squared is within
/// the search distance of the grid.
GPUREG_HD Closest find_closest(const ClosestGridView& grid, const Vec3* points, Vec3 q,
                               float max_squared) {
  const Closest none{kNoValue, max_squared};
  const float fx = q.x * grid.inverse_cell_size, fy = q.y * grid.inverse_cell_size,
              fz = q.z * grid.inverse_cell_size;
  const float limit =
      static_cast<float>(kCellBias) * static_cast<float>(ClosestGridView::kBlockEdge) - 1.0f;
  if (!(fx > -limit && fx < limit && fy > -limit && fy < limit && fz > -limit && fz < limit))
    return none;
  const Cell c{floor_to_int(fx), floor_to_int(fy), floor_to_int(fz)};
  const std::uint32_t block = find_cell(grid.table, cell_key({c.x >> 3, c.y >> 3, c.z >> 3}));
  if (block == kNoValue) return none;
  const std::uint32_t cell =
      static_cast<std::uint32_t>(((c.z & 7) << 6) | ((c.y & 7) << 3) | (c.x & 7));
  const std::uint32_t* start =
      grid.cell_start.data + static_cast<std::size_t>(block) * (ClosestGridView::kBlockCells + 1) +
      cell;
  return closest_candidate(grid.candidates.data, start[0], start[1], points, q, max_squared);
}

}  // namespace gpureg
