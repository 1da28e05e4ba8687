// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "cuda/common/bricks.cuh"
#include "cuda/common/candidate_lists.cuh"
#include "cuda/common/packed_normal.cuh"
#include "cuda/common/stage_data.hpp"
#include "cuda/device/exec.hpp"

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

/// The closest point of a cloud within a distance, with the cloud's copies of its values.
struct FoundPoint {
  float squared_distance;
  Vec3 point;
  std::uint32_t normal;  ///< packed
  std::uint32_t place;   ///< in the near lists; kNoValue: no point
  std::uint32_t index;   ///< of the point, where there is no place

  __device__ bool found() const { return (place & index) != kNoValue; }
  __device__ std::uint32_t index_in(const CellSummaries& cells) const {
    return place == kNoValue ? index : __ldg(cells.near_index + place);
  }
  /// normals_agree() of a moved normal and that of the point. The packed normal decides unless the
  /// cosine is near the limit.
  __device__ bool agrees(const CloudView& cloud, const CellSummaries& cells, Vec3 moved,
                         float min_cosine) const {
    if (min_cosine <= -1.0f) return true;
    if (normal == kPackedZero || is_zero(moved)) return false;
    const float off = dot(moved, unpack_normal(normal)) - min_cosine;
    return fabsf(off) > kHalfPackedCosineError
               ? off > 0.0f
               : normals_agree(moved, cloud.normals[index_in(cells)], min_cosine);
  }
};

/// find_closest() by the hash table, for clouds without a table of bricks.
static __device__ __noinline__ FoundPoint found_by_hash(const CloudView& cloud, Vec3 q,
                                                        float max_squared) {
  const Closest c = find_closest(cloud.closest, cloud.points, q, max_squared);
  if (c.index == kNoValue) return {max_squared, {0, 0, 0}, kPackedZero, kNoValue, kNoValue};
  return {c.squared_distance, cloud.points[c.index], pack_normal(cloud.normals[c.index]), kNoValue,
          c.index};
}

/// find_closest() with a table of bricks instead of a hash table.
__device__ inline FoundPoint find_point(const CloudView& cloud, const CellSummaries& cells, Vec3 q,
                                        float max_squared) {
  if (cells.nx == 0) return found_by_hash(cloud, q, max_squared);
  FoundPoint none{max_squared, {0, 0, 0}, kPackedZero, kNoValue, kNoValue};
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
  const uint2 block = __ldg(cells.block + word.number / 16);
  const ClosestCandidate best =
      closest_in_list(cells, block, __ldg(&cells.cell[cell_in_bricks(word, c)].y), q);
  if (best.place == kNoValue || !(best.squared_distance <= max_squared)) return none;
  const float4 near = __ldg(cells.near + best.place);  // read a moment ago
  return {best.squared_distance,
          {near.x, near.y, near.z},
          __float_as_uint(near.w),
          best.place,
          kNoValue};
}

__device__ inline Closest find_closest(const CloudView& cloud, const CellSummaries& cells, Vec3 q,
                                       float max_squared) {
  const FoundPoint best = find_point(cloud, cells, q, max_squared);
  return best.found() ? Closest{best.index_in(cells), best.squared_distance}
                      : Closest{kNoValue, max_squared};
}

}  // namespace gpureg::cuda
