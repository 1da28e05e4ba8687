// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/prepare/closest_lists.hpp"

#include "cuda/device/device_algorithms.hpp"
#include "cuda/device/entry_of.cuh"
#include "cuda/device/launch.cuh"
#include "cuda/device/warp.cuh"
#include "cuda/prepare/near_lists.hpp"
#include "cuda/prepare/neighbor_rows.cuh"
#include "pipeline/checks.hpp"

namespace gpureg::cuda {
namespace {

constexpr int kCells = ClosestGridView::kBlockCells;
constexpr int kThreads = 256;
constexpr std::uint32_t kTile = 512;  // near points in shared memory at a time
constexpr std::uint32_t kSortInShared = 2048;

struct Lists {
  const std::uint32_t* block_offset;  // per cloud
  const Cell* block;
  const ClosestGeometry* geometry;
  const GridView* grids;
  const std::uint32_t* point_offset;  // per cloud
  const Vec3* points;
  std::uint32_t clouds;
  std::uint32_t* near_start;  // per block; first the counts
  std::uint32_t* near;  // indices of the points within the search distance of a block, ascending
  std::uint32_t* used;  // 1 for those that are candidates
  // per cell: place in the near list of the point nearest to its centre, or kNoValue
  std::uint32_t* nearest;
  std::uint32_t* cell_start;   // blocks x 513
  std::uint32_t* list_start;   // per block; first the counts
  unsigned long long* totals;  // near points of all; most candidates of a block
  const std::size_t* candidate_offset;
  std::uint32_t* candidates;
};

/// Calls visit(index, inside) for all lanes at once over the points of the cells around a block.
template <typename Visit>
__device__ void for_each_near(const GridView& grid, Vec3 center, float reach, Visit&& visit) {
  const std::uint32_t lane = threadIdx.x % 32;
  NeighborRows rows(grid, center, 0.0f);
  rows.lo = cell_of({center.x - reach, center.y - reach, center.z - reach}, grid.inverse_cell_size);
  rows.hi = cell_of({center.x + reach, center.y + reach, center.z + reach}, grid.inverse_cell_size);
  rows.width = rows.hi.y - rows.lo.y + 1;
  rows.rows = rows.width * (rows.hi.z - rows.lo.z + 1);
  for (int first = 0; first < rows.rows; first += 32) {
    std::uint32_t my_begin, my_end;
    rows.run(grid, first + static_cast<int>(lane), my_begin, my_end);
    for (unsigned filled = __ballot_sync(~0u, my_begin != my_end); filled != 0;
         filled &= filled - 1) {
      const int row = __ffs(static_cast<int>(filled)) - 1;
      const std::uint32_t begin = __shfl_sync(~0u, my_begin, row),
                          end = __shfl_sync(~0u, my_end, row);
      for (std::uint32_t base = begin; base < end; base += 32) {
        const std::uint32_t k = base + lane;
        bool inside = k < end;
        if (inside) {
          const Vec3 d = grid.points[k] - center;
          inside = fabsf(d.x) <= reach && fabsf(d.y) <= reach && fabsf(d.z) <= reach;
        }
        visit(k < end ? grid.index[k] : 0, inside);
      }
    }
  }
}

/// A warp per block counts the points within the search distance of the block.
__global__ void count_near(Lists l, std::uint32_t blocks) {
  const std::uint32_t b = (blockIdx.x * blockDim.x + threadIdx.x) / 32;
  if (b >= blocks) return;
  const std::uint32_t c = entry_of(l.block_offset, l.clouds, b);
  const ClosestGeometry g = l.geometry[c];
  std::uint32_t count = 0;
  for_each_near(
      l.grids[c], cell_center(l.block[b], block_edge(g)), block_reach(g),
      [&](std::uint32_t, bool inside) {
        count += static_cast<std::uint32_t>(__popc(static_cast<int>(__ballot_sync(~0u, inside))));
      });
  if (threadIdx.x % 32 != 0) return;
  l.near_start[b] = count;
  atomicAdd(&l.totals[0], static_cast<unsigned long long>(count));
}

/// Sorts ascending by a bitonic network whose comparators all point one way, so that any size works
/// without padding.
__device__ void sort_ascending(std::uint32_t* values, std::uint32_t size) {
  std::uint32_t padded = 1;
  while (padded < size) padded *= 2;
  const auto order = [&](std::uint32_t a, std::uint32_t b) {
    if (b < size && values[a] > values[b]) {
      const std::uint32_t v = values[a];
      values[a] = values[b];
      values[b] = v;
    }
  };
  for (std::uint32_t run = 2; run <= padded; run *= 2) {
    __syncthreads();
    for (std::uint32_t k = threadIdx.x; k < padded / 2; k += blockDim.x) {
      const std::uint32_t base = k / (run / 2) * run, i = k % (run / 2);
      order(base + i, base + run - 1 - i);
    }
    for (std::uint32_t step = run / 4; step > 0; step /= 2) {
      __syncthreads();
      for (std::uint32_t k = threadIdx.x; k < padded / 2; k += blockDim.x) {
        const std::uint32_t a = k / step * 2 * step + k % step;
        order(a, a + step);
      }
    }
  }
  __syncthreads();
}

/// A thread block per block: its near points, ascending.
__global__ void __launch_bounds__(kThreads) list_near(Lists l) {
  __shared__ std::uint32_t sorted[kSortInShared];
  const std::uint32_t b = blockIdx.x, c = entry_of(l.block_offset, l.clouds, b);
  const ClosestGeometry g = l.geometry[c];
  const std::uint32_t begin = l.near_start[b], size = l.near_start[b + 1] - begin;
  std::uint32_t* list = size <= kSortInShared ? sorted : l.near + begin;
  if (threadIdx.x < 32) {
    std::uint32_t at = 0;
    for_each_near(l.grids[c], cell_center(l.block[b], block_edge(g)), block_reach(g),
                  [&](std::uint32_t index, bool inside) {
                    const unsigned mask = __ballot_sync(~0u, inside);
                    if (inside)
                      list[at + static_cast<std::uint32_t>(__popc(
                                    static_cast<int>(mask & ((1u << threadIdx.x) - 1))))] = index;
                    at += static_cast<std::uint32_t>(__popc(static_cast<int>(mask)));
                  });
  }
  sort_ascending(list, size);
  if (list != sorted) return;
  for (std::uint32_t k = threadIdx.x; k < size; k += kThreads) l.near[begin + k] = sorted[k];
}

__device__ Cell cell_of_block(Cell block, int cell) {
  return {block.x * 8 + (cell & 7), block.y * 8 + ((cell >> 3) & 7), block.z * 8 + (cell >> 6)};
}

/// Calls visit(k, point) for all near points in order, every thread of the block at once.
template <typename Visit>
__device__ void for_each_listed(const Vec3* points, const std::uint32_t* near, std::uint32_t size,
                                float4* tile, Visit&& visit) {
  for (std::uint32_t base = 0; base < size; base += kTile) {
    const std::uint32_t n = min(kTile, size - base);
    __syncthreads();
    for (std::uint32_t k = threadIdx.x; k < n; k += kThreads) {
      const Vec3 p = points[near[base + k]];
      tile[k] = make_float4(p.x, p.y, p.z, 0);
    }
    __syncthreads();
    for (std::uint32_t k = 0; k < n; ++k) visit(base + k, Vec3{tile[k].x, tile[k].y, tile[k].z});
  }
}

/// The point nearest to each cell's centre and the number of its candidates; offsets within the
/// block.
__global__ void __launch_bounds__(kThreads) count_candidates(Lists l) {
  __shared__ float4 tile[kTile];
  __shared__ std::uint32_t counts[kCells];
  const std::uint32_t b = blockIdx.x, c = entry_of(l.block_offset, l.clouds, b);
  const ClosestGeometry g = l.geometry[c];
  const Vec3* points = l.points + l.point_offset[c];
  const std::uint32_t begin = l.near_start[b], size = l.near_start[b + 1] - begin;
  for (int first = 0; first < kCells; first += kThreads) {
    const int cell = first + static_cast<int>(threadIdx.x);
    const Vec3 center = cell_center(cell_of_block(l.block[b], cell), g.cell_size);
    float nearest2 = 3.402823466e38f;
    std::uint32_t nearest = kNoValue;
    for_each_listed(points, l.near + begin, size, tile, [&](std::uint32_t k, Vec3 p) {
      const float d2 = squared_norm(p - center);
      if (d2 < nearest2) {
        nearest2 = d2;
        nearest = k;
      }
    });
    const float distance = sqrtf(nearest2);
    std::uint32_t count = 0;
    if (nearest != kNoValue && !can_reach_cell(distance, g)) nearest = kNoValue;
    const float limit = candidate_limit(distance, g), limit2 = limit * limit;
    const Vec3 best = nearest != kNoValue ? points[l.near[begin + nearest]] : Vec3{0, 0, 0};
    for_each_listed(points, l.near + begin, size, tile, [&](std::uint32_t k, Vec3 p) {
      if (nearest == kNoValue || squared_norm(p - center) > limit2) return;
      if (k != nearest && !can_win_in_cell(center, best, p, k > nearest, g)) return;
      ++count;
      l.used[begin + k] = 1;
    });
    l.nearest[static_cast<std::size_t>(b) * kCells + cell] = nearest;
    counts[cell] = count;
  }
  __syncthreads();
  // 512 numbers: one warp adds them up, 16 a lane.
  if (threadIdx.x >= 32) return;
  std::uint32_t mine = 0;
  for (int k = 0; k < 16; ++k) mine += counts[threadIdx.x * 16 + k];
  std::uint32_t at = warp_prefix_sum(mine) - mine;
  std::uint32_t* start = l.cell_start + static_cast<std::size_t>(b) * (kCells + 1);
  for (int k = 0; k < 16; ++k) {
    start[threadIdx.x * 16 + k] = at;
    at += counts[threadIdx.x * 16 + k];
  }
  if (threadIdx.x != 31) return;
  start[kCells] = at;
  l.list_start[b] = at;
  atomicMax(&l.totals[1], static_cast<unsigned long long>(at));
}

__global__ void __launch_bounds__(kThreads) write_candidates(Lists l) {
  __shared__ float4 tile[kTile];
  const std::uint32_t b = blockIdx.x, c = entry_of(l.block_offset, l.clouds, b);
  const ClosestGeometry g = l.geometry[c];
  const Vec3* points = l.points + l.point_offset[c];
  const std::uint32_t begin = l.near_start[b], size = l.near_start[b + 1] - begin;
  const std::uint32_t base = l.list_start[b] - l.list_start[l.block_offset[c]];
  std::uint32_t* candidates = l.candidates + l.candidate_offset[c] + base;
  std::uint32_t* start = l.cell_start + static_cast<std::size_t>(b) * (kCells + 1);
  for (int first = 0; first < kCells; first += kThreads) {
    const int cell = first + static_cast<int>(threadIdx.x);
    const Vec3 center = cell_center(cell_of_block(l.block[b], cell), g.cell_size);
    const std::uint32_t nearest = l.nearest[static_cast<std::size_t>(b) * kCells + cell];
    const Vec3 best = nearest != kNoValue ? points[l.near[begin + nearest]] : Vec3{0, 0, 0};
    const float limit = candidate_limit(sqrtf(squared_norm(best - center)), g),
                limit2 = limit * limit;
    std::uint32_t at = start[cell];
    for_each_listed(points, l.near + begin, size, tile, [&](std::uint32_t k, Vec3 p) {
      if (nearest == kNoValue || squared_norm(p - center) > limit2) return;
      if (k == nearest || can_win_in_cell(center, best, p, k > nearest, g))
        candidates[at++] = l.near[begin + k];
    });
  }
  __syncthreads();
  for (int cell = static_cast<int>(threadIdx.x); cell <= kCells; cell += kThreads)
    start[cell] += base;
}

}  // namespace

void fill_closest_lists(Exec& exec, const DownsampledClouds& clouds, const Grids& grids,
                        const ClosestGeometry* geometry, const PrepareSettings& options,
                        ClosestGrids& out) {
  const std::size_t count = clouds.segments.entries();
  const std::uint32_t blocks = out.blocks.total();
  out.cell_start = exec.buffer<std::uint32_t>(static_cast<std::size_t>(blocks) * (kCells + 1));
  out.candidate_offset.assign(count + 1, 0);
  out.size.resize(count);
  if (blocks == 0) return;
  const auto near_start = exec.filled<std::uint32_t>(blocks + 1, 0);
  const auto list_start = exec.filled<std::uint32_t>(blocks + 1, 0);
  const auto totals = exec.filled<unsigned long long>(2, 0);
  Lists l{};
  l.block_offset = out.blocks.on_device.data();
  l.block = out.block.data();
  l.geometry = geometry;
  l.grids = grids.views.data();
  l.point_offset = clouds.segments.on_device.data();
  l.points = clouds.points.data();
  l.clouds = static_cast<std::uint32_t>(count);
  l.near_start = near_start.data();
  l.list_start = list_start.data();
  l.totals = totals.data();
  l.cell_start = out.cell_start.data();
  launch(exec, "count_near", count_near, shape_for(std::size_t(blocks) * 32, kThreads), l, blocks);
  exclusive_sum(exec, near_start.data(), near_start.data(), blocks + 1);
  const unsigned long long* near_total = exec.download(totals.data(), 1);
  exec.synchronize();
  if (*near_total >= limits::kMaxPoints)
    pipeline::throw_too_dense(options.max_correspondence_distance);

  const auto near = exec.buffer<std::uint32_t>(*near_total);
  const auto nearest = exec.buffer<std::uint32_t>(static_cast<std::size_t>(blocks) * kCells);
  // Flags, then the number of candidates before each point.
  const auto used = exec.filled<std::uint32_t>(*near_total + 1, 0);
  l.near = near.data();
  l.used = used.data();
  l.nearest = nearest.data();
  launch(exec, "list_near", list_near, {blocks, kThreads}, l);
  launch(exec, "count_candidates", count_candidates, {blocks, kThreads}, l);
  exclusive_sum(exec, list_start.data(), list_start.data(), blocks + 1);
  exclusive_sum(exec, used.data(), used.data(), *near_total + 1);
  const unsigned long long* most = exec.download(totals.data() + 1, 1);
  measure_near_lists(exec, near_start.data(), used.data(), out);
  for (std::size_t c = 0; c < count; ++c) {
    const ClosestGridSize& size = out.size[c];
    if (pipeline::too_many_candidates(size.candidates, clouds.segments.size(c)) ||
        *most > limits::kMaxBlockCandidates || size.list_units > kMaxListUnits)
      pipeline::throw_too_dense(options.max_correspondence_distance);
    out.candidate_offset[c + 1] = out.candidate_offset[c] + size.candidates;
  }
  const auto candidate_offset = exec.upload(out.candidate_offset);
  out.candidates = exec.buffer<std::uint32_t>(out.candidate_offset.back());
  l.candidate_offset = candidate_offset.data();
  l.candidates = out.candidates.data();
  launch(exec, "write_candidates", write_candidates, {blocks, kThreads}, l);
  fill_near_lists(exec, near_start.data(), near.data(), used.data(),
                  static_cast<std::uint32_t>(*near_total), out);
}

}  // namespace gpureg::cuda
