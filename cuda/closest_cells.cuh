// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "bricks.cuh"
#include "exec.hpp"
#include "stage_data.hpp"

namespace gpureg::cuda {

/// A pair with the search tables of both clouds.
struct SearchPair {
  CloudView source, target;
  CellSummaries source_cells, target_cells;
  PriorTest prior;
};

inline SearchPair search_pair(const PairView& pair) {
  return {pair.source, pair.target,
          static_cast<const CudaCloud*>(pair.source.executor_data)->summaries,
          static_cast<const CudaCloud*>(pair.target.executor_data)->summaries, pair.prior};
}

inline DeviceBuffer<SearchPair> upload_search_pairs(Exec& exec, Span<const PairView> pairs) {
  std::vector<SearchPair> out;
  out.reserve(pairs.size);
  for (const PairView& pair : pairs) out.push_back(search_pair(pair));
  return exec.upload(out);
}

/// find_closest() with a table of bricks instead of a hash table, on contiguous copies of the
/// candidates. Lists of any length, anywhere in the array.
__device__ inline Closest find_closest(const CloudView& cloud, const CellSummaries& cells, Vec3 q,
                                       float max_squared) {
  if (cells.nx == 0) return find_closest(cloud.closest, cloud.points, q, max_squared);
  const Closest none{kNoValue, max_squared};
  const float fx = q.x * cloud.closest.inverse_cell_size,
              fy = q.y * cloud.closest.inverse_cell_size,
              fz = q.z * cloud.closest.inverse_cell_size;
  constexpr float kLimit =
      static_cast<float>(kCellBias) * static_cast<float>(ClosestGridView::kBlockEdge) - 1.0f;
  if (!(fabsf(fx) < kLimit && fabsf(fy) < kLimit && fabsf(fz) < kLimit)) return none;
  const BrickCell c{
      static_cast<std::uint32_t>(floor_to_int(fx) + static_cast<std::int32_t>(cells.offset.x) + 8),
      static_cast<std::uint32_t>(floor_to_int(fy) + static_cast<std::int32_t>(cells.offset.y) + 8),
      static_cast<std::uint32_t>(floor_to_int(fz) + static_cast<std::int32_t>(cells.offset.z) + 8)};
  const auto inside = [](std::uint32_t v, std::int32_t blocks) {
    return v >> 3 < static_cast<std::uint32_t>(blocks) + 2;
  };
  if (!inside(c.x, cells.nx) || !inside(c.y, cells.ny) || !inside(c.z, cells.nz)) return none;
  const BrickWord word = BrickTable(cells, 0).find(c, cells.run);
  if (!word.there) return none;
  const std::uint32_t list = __ldg(&cells.cell[cell_in_bricks(word, c)].y);
  std::uint32_t first = list >> 8, last = first + (list & 255u);
  if (list == kNoValue) {
    // The block gives the ends of any list. The table begins at a block, so the low bits of a cell
    // are those of the closest-point grid.
    const std::uint32_t* start = cloud.closest.cell_start.data +
                                 static_cast<std::size_t>(__ldg(cells.block + word.number / 16)) *
                                     (ClosestGridView::kBlockCells + 1) +
                                 ((c.z & 7) << 6 | (c.y & 7) << 3 | (c.x & 7));
    first = __ldg(start);
    last = __ldg(start + 1);
  }
  std::uint32_t best = kNoValue;
  float best_squared = 3.402823466e38f;
  for (std::uint32_t k = first; k < last; ++k) {
    const float4 c = __ldg(cells.candidate + k);
    const float d2 = squared_norm(Vec3{c.x, c.y, c.z} - q);
    const bool less = d2 < best_squared;
    best = less ? k : best;
    best_squared = less ? d2 : best_squared;
  }
  if (best == kNoValue || !(best_squared <= max_squared)) return none;
  return {__ldg(cloud.closest.candidates.data + best), best_squared};
}

}  // namespace gpureg::cuda
