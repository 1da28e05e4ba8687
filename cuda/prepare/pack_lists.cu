// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include <cub/block/block_scan.cuh>

#include "cuda/common/candidate_lists.hpp"
#include "cuda/common/packed_normal.cuh"
#include "cuda/device/entry_of.cuh"
#include "cuda/device/launch.cuh"
#include "cuda/prepare/brick_place.cuh"
#include "cuda/prepare/scoring_data.hpp"

namespace gpureg::cuda {
namespace {

constexpr int kCells = ClosestGridView::kBlockCells;

/// A thread block takes one block after another, and a thread its cell.
__global__ void __launch_bounds__(kCells) write_lists(const ScoringSlot* slots) {
  using Scan = cub::BlockScan<std::uint32_t, kCells>;
  __shared__ typename Scan::TempStorage storage;
  const ScoringSlot& s = slots[blockIdx.y];
  if (s.summaries.nx == 0) return;
  const int cell = static_cast<int>(threadIdx.x);
  for (std::uint32_t b = blockIdx.x; b < s.block_count; b += gridDim.x) {
    const std::uint32_t* start = s.cell_start + static_cast<std::size_t>(b) * (kCells + 1) + cell;
    const std::uint32_t* candidates = s.candidates + start[0];
    const std::uint32_t* near = s.near + s.near_start[b];
    const std::uint32_t count = start[1] - start[0],
                        near_points = s.near_start[b + 1] - s.near_start[b],
                        size = position_size(near_points), unit = s.list_start[b] - s.list_start[0];
    std::uint32_t first;
    __syncthreads();
    Scan(storage).ExclusiveSum(list_room(count, size), first);
    const BrickWord at = brick_word(s.summaries, s.blocks[b], cell);
    if (!at.there) continue;
    if (cell % 8 == 0 && at.number % 16 == 0)
      s.summaries.block[at.number / 16] =
          pack_block_lists(s.near_start[b] - s.near_start[0], unit, size);
    std::uint32_t word = count;
    if (fits_word(count, size)) {
      for (std::uint32_t k = 0; k < count; ++k)
        word |= entry_of(near, near_points, candidates[k]) << (8 + (k << (3 + size)));
    } else {
      std::uint32_t* words =
          s.summaries.positions + static_cast<std::size_t>(unit) * (kListUnit / sizeof(word));
      if (count >= kLongList) {
        first = aligned_position(first, size);
        words[(first << size) / 4] = count;
      }
      word = first << 8 | min(count, kLongList);
      if (count >= kLongList) first += positions_per_word(size);
      for (std::uint32_t k = 0; k < count; ++k) {
        const std::uint32_t position = entry_of(near, near_points, candidates[k]);
        if (size == 0)
          reinterpret_cast<std::uint8_t*>(words)[first + k] = static_cast<std::uint8_t>(position);
        else if (size == 1)
          reinterpret_cast<std::uint16_t*>(words)[first + k] = static_cast<std::uint16_t>(position);
        else
          words[first + k] = position;
      }
    }
    s.summaries.cell[std::size_t(at.number) * 8 + (cell & 7)].y = word;
  }
}

__global__ void copy_near_points(const ScoringSlot* slots) {
  const ScoringSlot& s = slots[blockIdx.y];
  if (s.summaries.nx == 0) return;
  const std::uint32_t first = s.near_start[0], size = s.near_start[s.block_count] - first;
  for (std::uint32_t k = blockIdx.x * blockDim.x + threadIdx.x; k < size;
       k += gridDim.x * blockDim.x) {
    const std::uint32_t i = s.near[first + k];
    const Vec3 p = s.view.points[i];
    s.summaries.near[k] =
        make_float4(p.x, p.y, p.z, __uint_as_float(pack_normal(s.view.normals[i])));
    s.summaries.near_index[k] = i;
  }
}

}  // namespace

void pack_lists(Exec& exec, const DeviceBuffer<ScoringSlot>& slots, std::uint32_t most_blocks) {
  constexpr std::uint32_t kMostThreadBlocks = 1024;  // of a cloud
  const unsigned count = static_cast<unsigned>(slots.size());
  launch(exec, "write_lists", write_lists,
         {{std::max(1u, std::min(most_blocks, kMostThreadBlocks)), count}, kCells}, slots.data());
  launch(exec, "copy_near_points", copy_near_points, {{64, count}, 256}, slots.data());
}

}  // namespace gpureg::cuda
