// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/candidate_lists.hpp"

/// Search in the candidates of a cell.
namespace gpureg::cuda {

__device__ inline BlockLists unpack_block_lists(const CellSummaries& cells, uint2 packed) {
  return {cells.positions +
              static_cast<std::size_t>(packed.y & ~kListBit) * (kListUnit / sizeof(std::uint32_t)),
          packed.x & ~kListBit, packed.x >> 31 | packed.y >> 31 << 1};
}

/// Closest candidate of a cell.
struct ClosestCandidate {
  float squared_distance;
  std::uint32_t place;  ///< in the near lists of the cloud; kNoValue: the cell has no candidates
};

/// closest_candidate() of the cell with this word, in a brick with this entry of
/// CellSummaries::block. Callers load the two at once.
__device__ inline ClosestCandidate closest_in_list(const CellSummaries& cells, uint2 block,
                                                   std::uint32_t word, Vec3 q) {
  constexpr std::uint32_t kAtOnce = 4;  // loads in flight hide the latency of memory
  const BlockLists lists = unpack_block_lists(cells, block);
  std::uint32_t count = word & 255u, first = word >> 8;
  if (count == 0) return {3.402823466e38f, kNoValue};
  const bool in_word = fits_word(count, lists.size);
  if (count == kLongList) {
    count = __ldg(lists.words + (first << lists.size) / 4);
    first += positions_per_word(lists.size);
  }
  const float4* near = cells.near + lists.near;
  std::uint32_t best = 0;
  float best_squared = 3.402823466e38f;
#pragma unroll 1
  for (std::uint32_t k = 0; k < count; k += kAtOnce) {
    // Beyond the last one the first of the four repeats, which changes nothing.
    std::uint32_t at[kAtOnce];
    if (lists.size == 0) {
      std::uint32_t four = first;
      if (!in_word) {
        // The word behind may belong to the next list; the array ends with a unit to spare.
        const std::uint32_t* words = lists.words + (first + k) / 4;
        four = __funnelshift_r(__ldg(words), __ldg(words + 1), (first + k) % 4 * 8);
      }
#pragma unroll
      for (std::uint32_t i = 0; i < kAtOnce; ++i)
        at[i] = (k + i < count ? four >> 8 * i : four) & 255u;
    } else {
#pragma unroll
      for (std::uint32_t i = 0; i < kAtOnce; ++i) {
        const std::uint32_t p = first + (k + i < count ? k + i : k);
        at[i] = in_word           ? first
                : lists.size == 1 ? __ldg(reinterpret_cast<const std::uint16_t*>(lists.words) + p)
                                  : __ldg(lists.words + p);
      }
    }
    Vec3 c[kAtOnce];
#pragma unroll
    for (std::uint32_t i = 0; i < kAtOnce; ++i) {
      const float4 one = __ldg(near + at[i]);
      c[i] = {one.x, one.y, one.z};
    }
#pragma unroll
    for (std::uint32_t i = 0; i < kAtOnce; ++i) {
      const float d2 = squared_norm(c[i] - q);
      const bool less = d2 < best_squared;
      best = less ? at[i] : best;
      best_squared = less ? d2 : best_squared;
    }
  }
  return {best_squared, lists.near + best};
}

}  // namespace gpureg::cuda
