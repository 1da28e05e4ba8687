// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/prepare/scoring_data.hpp"

#include <cub/block/block_scan.cuh>

#include <numeric>

#include "algorithm/cell_summary.hpp"
#include "cuda/common/candidate_lists.hpp"
#include "cuda/common/packed_normal.cuh"
#include "cuda/device/device_algorithms.hpp"
#include "cuda/device/launch.cuh"
#include "cuda/prepare/brick_place.cuh"
#include "cuda/prepare/directions.hpp"

namespace gpureg::cuda {
namespace {

constexpr int kCells = ClosestGridView::kBlockCells;
constexpr std::size_t kBrickCells = kCells / 4;
using limits::kMaxSummaryBlocks;
/// BrickMotion counts cells, including those of the empty blocks on both sides, in 22 bits.
constexpr std::uint64_t kMaxBlocksAlong = (std::uint64_t(1) << 19) - 2;

/// A word of a brick is numbered in 32 bits.
constexpr std::uint64_t kMaxNumberedBlocks = std::uint64_t(1) << 25;
/// Size of the table of a large map; its other arrays take 4 KB a block.
constexpr std::uint64_t kPlacesPerBlock = 64, kRunsPerBlock = 8;

/// CellSummaries::brick_runs() without overflow.
std::uint64_t runs_of(std::uint64_t nx, std::uint64_t ny, std::uint64_t nz) {
  return (nx + 2 + 31) / 32 * (2 * (ny + 2)) * (2 * (nz + 2));
}

constexpr int kNumberThreads = 512;
/// Steps of the golden section spread groups evenly, however many are read.
constexpr double kGoldenSection = 0.6180339887;
/// Bits of a Morton key: ten per coordinate.
constexpr int kMortonBits = 30;

/// Sets the bit of each brick that has a cell with candidates.
__global__ void mark_bricks(const ScoringSlot* slots) {
  const ScoringSlot& s = slots[blockIdx.y];
  const CellSummaries& v = s.summaries;
  if (v.nx == 0) return;
  for (std::uint32_t k = blockIdx.x * blockDim.x + threadIdx.x; k < s.block_count * 4;
       k += gridDim.x * blockDim.x) {
    const std::uint32_t b = k / 4, upper_y = k & 1, upper_z = (k >> 1) & 1;
    const std::uint32_t* start = s.cell_start + static_cast<std::size_t>(b) * (kCells + 1);
    bool any = false;
    for (std::uint32_t row = 0; row < 16; ++row) {
      const std::uint32_t cell = ((upper_z * 4 + row / 4) * 8 + upper_y * 4 + row % 4) * 8;
      any = any || start[cell] != start[cell + 8];
    }
    if (!any) continue;
    const BrickPlace place =
        place_of_brick(v, s.blocks[b], static_cast<int>(upper_z << 8 | upper_y << 5));
    atomicOr(&v.run[place.run].x, place.bit);
  }
}

/// Numbers the bricks in the order of the runs. A thread block per cloud.
__global__ void __launch_bounds__(kNumberThreads) number_bricks(const ScoringSlot* slots) {
  using Scan = cub::BlockScan<std::uint32_t, kNumberThreads>;
  __shared__ typename Scan::TempStorage storage;
  const CellSummaries& v = slots[blockIdx.x].summaries;
  if (v.nx == 0) return;
  const std::uint32_t runs = v.brick_runs();
  std::uint32_t before = 0;
  for (std::uint32_t first = 0; first < runs; first += kNumberThreads) {
    const std::uint32_t k = first + threadIdx.x;
    std::uint32_t upto, all;
    Scan(storage).InclusiveSum(
        k < runs ? static_cast<std::uint32_t>(__popc(static_cast<int>(v.run[k].x))) : 0u, upto,
        all);
    if (k < runs) v.run[k].y = 16 * (before + upto);
    before += all;
    __syncthreads();
  }
  if (threadIdx.x == 0) v.run[runs] = make_uint2(0, before);
}

__global__ void summarize(const ScoringSlot* slots, const DirectionTables* tables) {
  const ScoringSlot& s = slots[blockIdx.y];
  if (s.summaries.nx == 0) return;
  const std::size_t cells = static_cast<std::size_t>(s.block_count) * kCells;
  for (std::size_t k = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x; k < cells;
       k += static_cast<std::size_t>(gridDim.x) * blockDim.x) {
    const std::size_t b = k / kCells;
    const int cell = static_cast<int>(k % kCells);
    const std::uint32_t* start = s.cell_start + b * (kCells + 1) + cell;
    const Cell block = s.blocks[b];
    const Cell c{block.x * 8 + (cell & 7), block.y * 8 + ((cell >> 3) & 7),
                 block.z * 8 + (cell >> 6)};
    const Span<const std::uint32_t> candidates{s.candidates + start[0], start[1] - start[0]};
    const bool empty = candidates.size == 0;
    // Eight lanes hold the cells of a word.
    std::uint32_t codes =
        empty ? 0u : code_of_cell(*tables, candidates, s.view.normals) << 4 * (cell & 7);
    for (int step = 1; step < 8; step *= 2) codes |= __shfl_xor_sync(~0u, codes, step);
    const BrickWord word = brick_word(s.summaries, block, cell);
    if (!word.there) continue;
    if ((cell & 7) == 0) s.summaries.brick[word.number] = codes;
    s.summaries.cell[std::size_t(word.number) * 8 + (cell & 7)].x =
        empty ? 0u
              : summarize_cell(candidates, cell_center(c, s.geometry.cell_size), s.geometry,
                               s.view.points, s.view.normals);
  }
}

/// The low 10 bits of each coordinate, interleaved.
__device__ std::uint32_t morton(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  const auto spread = [](std::uint32_t v) {
    v = (v | v << 16) & 0x030000ffu;
    v = (v | v << 8) & 0x0300f00fu;
    v = (v | v << 4) & 0x030c30c3u;
    return (v | v << 2) & 0x09249249u;
  };
  return spread(x) | spread(y) << 1 | spread(z) << 2;
}

__global__ void write_morton_keys(const ScoringSlot* slots, std::uint64_t* keys,
                                  std::uint32_t* index) {
  const ScoringSlot& s = slots[blockIdx.y];
  const float scale = 511.0f / s.view.radius;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < s.view.size;
       i += gridDim.x * blockDim.x) {
    const Vec3 p = s.view.points[i] * scale;
    const auto unit = [](float v) { return static_cast<std::uint32_t>(v + 512.0f); };
    keys[s.point_offset + i] =
        static_cast<std::uint64_t>(blockIdx.y) << 30 | morton(unit(p.x), unit(p.y), unit(p.z));
    index[s.point_offset + i] = i;
  }
}

__global__ void write_order(const ScoringSlot* slots, const std::uint32_t* index,
                            const DirectionTables* tables) {
  const ScoringSlot& s = slots[blockIdx.y];
  for (std::uint32_t k = blockIdx.x * blockDim.x + threadIdx.x; k < s.order.groups * 32;
       k += gridDim.x * blockDim.x) {
    const std::uint32_t from = static_cast<std::uint32_t>(static_cast<std::uint64_t>(k / 32) *
                                                          s.group_step % s.order.groups) *
                                   32 +
                               k % 32;
    const float nan = __uint_as_float(0x7fc00000u);
    float4 point = make_float4(nan, nan, nan, __uint_as_float(kClassNone));
    std::uint32_t normal = kPackedZero, i = kNoValue;
    if (from < s.view.size) {
      i = index[s.point_offset + from];
      const Vec3 p = s.view.points[i], n = s.view.normals[i];
      point = make_float4(p.x, p.y, p.z, __uint_as_float(class_of_normal(*tables, n)));
      normal = pack_normal(n);
    }
    s.order.point[k] = point;
    s.order.normal[k] = normal;
    s.order.index[k] = i;
  }
}

}  // namespace

ScoringLayout scoring_layout(std::uint32_t points, const ClosestGridSize& size,
                             const CellRange& blocks) {
  ScoringLayout l{};
  l.first_block = blocks.lo;
  const std::uint64_t nx = static_cast<std::uint64_t>(blocks.hi.x - blocks.lo.x + 1),
                      ny = static_cast<std::uint64_t>(blocks.hi.y - blocks.lo.y + 1),
                      nz = static_cast<std::uint64_t>(blocks.hi.z - blocks.lo.z + 1);
  CellSummaries shape;
  shape.nx = static_cast<std::int32_t>(nx);
  shape.ny = static_cast<std::int32_t>(ny);
  shape.nz = static_cast<std::int32_t>(nz);
  // A large map may have a large table: up to 64 places for each of its blocks.
  const std::uint64_t most_blocks = std::max(kMaxSummaryBlocks, kPlacesPerBlock * size.blocks),
                      most_runs = std::max(kMaxSummaryBlocks, kRunsPerBlock * size.blocks);
  const bool fits = nx <= kMaxBlocksAlong && ny <= kMaxBlocksAlong && nz <= kMaxBlocksAlong &&
                    size.blocks <= kMaxNumberedBlocks && nx * ny <= most_blocks &&
                    nx * ny * nz <= most_blocks && runs_of(nx, ny, nz) <= most_runs;
  if (fits) {
    l.nx = static_cast<std::int32_t>(nx);
    l.ny = static_cast<std::int32_t>(ny);
    l.nz = static_cast<std::int32_t>(nz);
  }
  const auto take = [&](std::size_t bytes) {
    const std::size_t at = l.bytes;
    l.bytes += (bytes + 255) / 256 * 256;
    return at;
  };
  const std::size_t padded = (points + std::size_t(31)) / 32 * 32, bricks = fits ? size.bricks : 0,
                    near = fits ? size.near_points : 0;
  l.near = take(near * sizeof(float4));
  l.near_index = take(near * sizeof(std::uint32_t));
  // Reading a list goes up to a word beyond its end.
  l.positions = take(fits ? (size.list_units + 1) * kListUnit : 0);
  l.points = take(padded * sizeof(float4));
  l.normals = take(padded * sizeof(std::uint32_t));
  l.index = take(padded * sizeof(std::uint32_t));
  l.cells = take(bricks * kBrickCells * sizeof(uint2));
  l.blocks = take(bricks * sizeof(uint2));
  l.runs = take(fits ? (std::size_t(shape.brick_runs()) + 1) * sizeof(uint2) : 0);
  l.bricks = take(bricks * (kBrickCells / 8) * sizeof(std::uint32_t));
  return l;
}

void place_scoring_data(const ScoringLayout& l, const ClosestGeometry& geometry, char* memory,
                        CudaCloud& cloud) {
  CellSummaries& v = cloud.summaries;
  v.inverse_cell_size = 1.0f / geometry.cell_size;
  v.offset = {-static_cast<float>(l.first_block.x * ClosestGridView::kBlockEdge),
              -static_cast<float>(l.first_block.y * ClosestGridView::kBlockEdge),
              -static_cast<float>(l.first_block.z * ClosestGridView::kBlockEdge)};
  v.nx = l.nx;
  v.ny = l.ny;
  v.nz = l.nz;
  v.near = reinterpret_cast<float4*>(memory + l.near);
  v.near_index = reinterpret_cast<std::uint32_t*>(memory + l.near_index);
  v.positions = reinterpret_cast<std::uint32_t*>(memory + l.positions);
  cloud.order.groups = (cloud.size + 31) / 32;
  cloud.order.point = reinterpret_cast<float4*>(memory + l.points);
  cloud.order.normal = reinterpret_cast<std::uint32_t*>(memory + l.normals);
  cloud.order.index = reinterpret_cast<std::uint32_t*>(memory + l.index);
  v.cell = reinterpret_cast<uint2*>(memory + l.cells);
  v.run = reinterpret_cast<uint2*>(memory + l.runs);
  v.brick = reinterpret_cast<std::uint32_t*>(memory + l.bricks);
  v.block = reinterpret_cast<uint2*>(memory + l.blocks);
}

void fill_scoring_data(Exec& exec, const std::vector<std::shared_ptr<CudaCloud>>& clouds,
                       const ClosestGrids& grids) {
  std::vector<ScoringSlot> slots;
  std::uint32_t total = 0;
  for (std::size_t c = 0; c < clouds.size(); ++c) {
    CudaCloud& cloud = *clouds[c];
    const std::uint32_t groups = cloud.order.groups;
    std::uint32_t step = static_cast<std::uint32_t>(kGoldenSection * groups) | 1u;
    while (groups > 0 && std::gcd(step, groups) != 1) ++step;
    ScoringSlot slot{};
    slot.view = cloud.view_on_device;
    slot.summaries = cloud.summaries;
    slot.order = cloud.order;
    slot.geometry = grids.geometry[c];
    const std::size_t first_block = grids.blocks.offset[c];
    slot.block_count = grids.blocks.size(c);
    slot.blocks = grids.block.data() + first_block;
    slot.cell_start = grids.cell_start.data() + first_block * (kCells + 1);
    slot.candidates = grids.candidates.data() + grids.candidate_offset[c];
    slot.near_start = grids.near_start.data() + first_block;
    slot.list_start = grids.list_start.data() + first_block;
    slot.near = grids.near.data();
    slot.group_step = step;
    slot.point_offset = total;
    slots.push_back(slot);
    total += cloud.size;
  }
  if (total == 0) return;
  const auto on_device = exec.upload(slots);
  const DirectionTables host_tables = direction_tables();
  const auto tables = exec.upload(&host_tables, 1);
  auto keys = exec.buffer<std::uint64_t>(total);
  auto index = exec.buffer<std::uint32_t>(total);
  const unsigned count = static_cast<unsigned>(clouds.size());
  launch(exec, "mark_bricks", mark_bricks, {{8, count}, 128}, on_device.data());
  launch(exec, "number_bricks", number_bricks, {count, kNumberThreads}, on_device.data());
  launch(exec, "summarize", summarize, {{128, count}, 256}, on_device.data(), tables.data());
  pack_lists(exec, on_device, grids.blocks.largest);
  launch(exec, "write_morton_keys", write_morton_keys, {{16, count}, 256}, on_device.data(),
         keys.data(), index.data());
  int bits = kMortonBits;
  while ((std::size_t(1) << (bits - kMortonBits)) < clouds.size()) ++bits;
  sort_pairs(exec, keys, index, bits);
  launch(exec, "write_order", write_order, {{16, count}, 256}, on_device.data(), index.data(),
         tables.data());
}

}  // namespace gpureg::cuda
