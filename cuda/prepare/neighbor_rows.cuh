// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/grid.hpp"

namespace gpureg::cuda {

/// Walk of a warp over the neighbourhood of one point. Cells that are adjacent along x are adjacent
/// in the sorted points too, so a neighbourhood is one run of points per (z, y). The order over all
/// runs is that of for_each_neighbor.
struct NeighborRows {
  Cell lo, hi;
  int rows, width;

  __device__ NeighborRows(const GridView& grid, Vec3 q, float radius) {
    const float reach = radius * kBallMargin;  // as for_each_neighbor
    lo = cell_of({q.x - reach, q.y - reach, q.z - reach}, grid.inverse_cell_size);
    hi = cell_of({q.x + reach, q.y + reach, q.z + reach}, grid.inverse_cell_size);
    width = hi.y - lo.y + 1;
    rows = width * (hi.z - lo.z + 1);
  }
  /// Points [begin, end) of one row, empty where it has none.
  __device__ void run(const GridView& grid, int row, std::uint32_t& begin,
                      std::uint32_t& end) const {
    begin = end = 0;
    if (row >= rows) return;
    const std::int32_t z = lo.z + row / width, y = lo.y + row % width;
    for (std::int32_t x = lo.x; x <= hi.x; ++x) {
      const std::uint32_t cell = find_cell(grid.table, cell_key({x, y, z}));
      if (cell == kNoValue) continue;
      if (begin == end) begin = grid.cell_start[cell];
      end = grid.cell_start[cell + 1];
    }
  }
};

/// Calls visit(k, d2, inside) for all lanes of a warp at once, 32 points of a run at a time: k is
/// the sorted position (beyond the run for idle lanes), inside tells whether it is a neighbour.
template <typename Visit>
__device__ void for_each_neighbor_warp(const GridView& grid, Vec3 q, float radius, Visit&& visit) {
  const int lane = static_cast<int>(threadIdx.x % 32);
  const float r2 = radius * radius;
  const NeighborRows rows(grid, q, radius);
  for (int first = 0; first < rows.rows; first += 32) {
    std::uint32_t my_begin, my_end;
    rows.run(grid, first + lane, my_begin, my_end);
    unsigned filled = __ballot_sync(~0u, my_begin != my_end);
    for (; filled != 0; filled &= filled - 1) {
      const int row = __ffs(static_cast<int>(filled)) - 1;
      const std::uint32_t begin = __shfl_sync(~0u, my_begin, row),
                          end = __shfl_sync(~0u, my_end, row);
      for (std::uint32_t base = begin; base < end; base += 32) {
        const std::uint32_t k = base + static_cast<std::uint32_t>(lane);
        const float d2 = k < end ? squared_norm(grid.points[k] - q) : 3.402823466e38f;
        visit(k, d2, k < end && d2 <= r2);
      }
    }
  }
}

}  // namespace gpureg::cuda
