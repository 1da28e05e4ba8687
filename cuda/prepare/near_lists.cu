// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/prepare/near_lists.hpp"

#include "cuda/common/candidate_lists.hpp"
#include "cuda/device/device_algorithms.hpp"
#include "cuda/device/entry_of.cuh"
#include "cuda/device/launch.cuh"
#include "cuda/device/warp.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kCells = ClosestGridView::kBlockCells;

struct Sizes {
  unsigned long long candidates, near_points, list_units, bricks;
};

/// A thread block per block, a thread per cell. cell_start: still within the block.
__global__ void __launch_bounds__(kCells)
    measure(const std::uint32_t* block_offset, std::uint32_t clouds,
            const std::uint32_t* near_start, const std::uint32_t* used,
            const std::uint32_t* cell_start, std::uint32_t* list_start, Sizes* sizes) {
  __shared__ std::uint32_t positions, bricks;
  const std::uint32_t b = blockIdx.x;
  if (threadIdx.x == 0) positions = bricks = 0;
  __syncthreads();
  const std::uint32_t near_points = used[near_start[b + 1]] - used[near_start[b]],
                      position = position_size(near_points);
  const std::uint32_t* start = cell_start + static_cast<std::size_t>(b) * (kCells + 1);
  const std::uint32_t count = start[threadIdx.x + 1] - start[threadIdx.x],
                      room = warp_sum(list_room(count, position));
  // The cells of a warp are in one brick: four rows along x, lower or upper half along y and z.
  const bool any = __any_sync(~0u, count > 0);
  if (threadIdx.x % 32 == 0) {
    atomicAdd(&positions, room);
    if (any) atomicOr(&bricks, 1u << ((threadIdx.x >> 5 & 1) | (threadIdx.x >> 8 & 1) << 1));
  }
  __syncthreads();
  if (threadIdx.x != 0) return;
  const std::uint32_t units = ((positions << position) + kListUnit - 1) / kListUnit;
  list_start[b] = units;
  Sizes& s = sizes[entry_of(block_offset, clouds, b)];
  atomicAdd(&s.candidates, static_cast<unsigned long long>(start[kCells]));
  atomicAdd(&s.near_points, static_cast<unsigned long long>(near_points));
  atomicAdd(&s.list_units, static_cast<unsigned long long>(units));
  atomicAdd(&s.bricks, static_cast<unsigned long long>(__popc(static_cast<int>(bricks))));
}

__global__ void keep_candidates(const std::uint32_t* near, const std::uint32_t* used,
                                std::uint32_t points, std::uint32_t* out) {
  const std::uint32_t k = blockIdx.x * blockDim.x + threadIdx.x;
  if (k < points && used[k + 1] != used[k]) out[used[k]] = near[k];
}

__global__ void write_starts(const std::uint32_t* near_start, const std::uint32_t* used,
                             std::uint32_t blocks, std::uint32_t* out) {
  const std::uint32_t b = blockIdx.x * blockDim.x + threadIdx.x;
  if (b <= blocks) out[b] = used[near_start[b]];
}

}  // namespace

void measure_near_lists(Exec& exec, const std::uint32_t* near_start, const std::uint32_t* used,
                        ClosestGrids& out) {
  const std::size_t clouds = out.blocks.entries();
  const std::uint32_t blocks = out.blocks.total();
  out.list_start = exec.buffer<std::uint32_t>(blocks);
  const auto sizes = exec.filled<Sizes>(clouds, 0);
  launch(exec, "measure", measure, {blocks, kCells}, out.blocks.on_device.data(),
         static_cast<std::uint32_t>(clouds), near_start, used, out.cell_start.data(),
         out.list_start.data(), sizes.data());
  exclusive_sum(exec, out.list_start.data(), out.list_start.data(), blocks);
  const Sizes* host = exec.download(sizes.data(), clouds);
  exec.synchronize();
  for (std::size_t c = 0; c < clouds; ++c)
    out.size[c] = {out.blocks.size(c), static_cast<std::uint32_t>(host[c].bricks),
                   host[c].candidates, host[c].near_points, host[c].list_units};
}

void fill_near_lists(Exec& exec, const std::uint32_t* near_start, const std::uint32_t* near,
                     const std::uint32_t* used, std::uint32_t points, ClosestGrids& out) {
  const std::uint32_t blocks = out.blocks.total();
  std::uint64_t kept = 0;
  for (const ClosestGridSize& size : out.size) kept += size.near_points;
  out.near = exec.buffer<std::uint32_t>(kept);
  out.near_start = exec.buffer<std::uint32_t>(blocks + 1);
  launch(exec, "write_starts", write_starts, shape_for(std::size_t(blocks) + 1, 256), near_start,
         used, blocks, out.near_start.data());
  if (points == 0) return;
  launch(exec, "keep_candidates", keep_candidates, shape_for(points, 256), near, used, points,
         out.near.data());
}

}  // namespace gpureg::cuda
