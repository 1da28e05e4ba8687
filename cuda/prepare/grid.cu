// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/common/stages.hpp"
#include "cuda/device/group_by_cell.cuh"
#include "cuda/device/hash_table.cuh"
#include "cuda/device/launch.cuh"
#include "pipeline/checks.hpp"

namespace gpureg::cuda {
namespace {

struct CellOfPoint {
  const std::uint32_t* offset;
  const Vec3* points;
  float inverse;
  __device__ bool operator()(std::uint32_t c, std::uint32_t i, Cell& cell) const {
    cell = cell_of(points[offset[c] + i], inverse);
    return true;
  }
};

struct Fill {
  const std::uint32_t* offset;
  const std::uint32_t* item;
  const std::uint32_t* rank;
  const Vec3* points;
  const GridView* views;
  float inverse;
  CellEntry* table;
  const std::size_t* table_offset;
  // a cloud's begins at its offset plus its number: each has one entry more than cells
  std::uint32_t* cell_start;
  Vec3* sorted_points;
};

/// Points in cell order, the cells' first points, and the table from keys to cells.
__global__ void fill_grid(Fill f) {
  const std::uint32_t c = blockIdx.y, begin = f.offset[c], size = f.offset[c + 1] - begin;
  const std::uint32_t first_rank = f.rank[begin];
  std::uint32_t* cell_start = f.cell_start + begin + c;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < size;
       i += gridDim.x * blockDim.x) {
    const Vec3 p = f.points[begin + f.item[begin + i]];
    f.sorted_points[begin + i] = p;
    const std::uint32_t cell = f.rank[begin + i] - first_rank;
    if (f.rank[begin + i + 1] - first_rank == cell) continue;
    cell_start[cell] = i;
    insert_key(f.table + f.table_offset[c],
               static_cast<std::uint32_t>(f.table_offset[c + 1] - f.table_offset[c]),
               cell_key(cell_of(p, f.inverse)), cell);
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) cell_start[f.rank[begin + size] - first_rank] = size;
}

/// Sum over the cells of their squared sizes.
__global__ void measure_density(const std::uint32_t* offset, const std::uint32_t* rank,
                                const std::uint32_t* cell_start, unsigned long long* squares) {
  const std::uint32_t c = blockIdx.y, begin = offset[c];
  const std::uint32_t cells = rank[offset[c + 1]] - rank[begin];
  unsigned long long sum = 0;
  for (std::uint32_t k = blockIdx.x * blockDim.x + threadIdx.x; k < cells;
       k += gridDim.x * blockDim.x) {
    const unsigned long long n = cell_start[begin + c + k + 1] - cell_start[begin + c + k];
    sum += n * n;
  }
  if (sum > 0) atomicAdd(squares + c, sum);
}

}  // namespace

Grids build_grids(Exec& exec, const DownsampledClouds& clouds, const PrepareSettings& options) {
  constexpr unsigned kThreads = 256;
  const Segments& segments = clouds.segments;
  const std::size_t count = segments.entries();
  const float cell_size = options.feature_radius * 0.5f;
  const float inverse = 1.0f / cell_size;
  std::vector<CellRange> ranges;
  for (const CloudFacts& facts : clouds.facts) {
    // A centroid may lie outside the box of its points by a rounding.
    const Cell lo = cell_of(facts.lo, inverse), hi = cell_of(facts.hi, inverse);
    ranges.push_back({{lo.x - 1, lo.y - 1, lo.z - 1}, {hi.x + 1, hi.y + 1, hi.z + 1}});
  }
  Groups cells =
      group_by_cell(exec, segments, ranges,
                    CellOfPoint{segments.on_device.data(), clouds.points.data(), inverse});

  std::vector<std::size_t> table_offset{0};
  for (std::size_t c = 0; c < count; ++c)
    table_offset.push_back(table_offset.back() + table_size(segments.size(c)));
  const auto table_offset_on_device = exec.upload(table_offset);
  Grids out;
  out.table = exec.filled<CellEntry>(table_offset.back(), 0xff);
  out.cell_start = exec.buffer<std::uint32_t>(segments.total() + count);
  out.points = exec.buffer<Vec3>(segments.total());
  out.index = std::move(cells.item);
  std::vector<GridView> views;
  for (std::size_t c = 0; c < count; ++c) {
    const std::size_t begin = segments.offset[c], size = segments.size(c);
    views.push_back({cell_size,
                     inverse,
                     {out.table.data() + table_offset[c], table_offset[c + 1] - table_offset[c]},
                     {out.cell_start.data() + begin + c, size + 1},
                     {out.points.data() + begin, size},
                     {out.index.data() + begin, size}});
  }
  out.views = exec.upload(views);
  const dim3 grid(std::max(1u, std::min(blocks_for(segments.largest, kThreads), 1024u)),
                  static_cast<unsigned>(count));
  Fill batch{};
  batch.offset = segments.on_device.data();
  batch.item = out.index.data();
  batch.rank = cells.rank.data();
  batch.points = clouds.points.data();
  batch.views = out.views.data();
  batch.inverse = inverse;
  batch.table = out.table.data();
  batch.table_offset = table_offset_on_device.data();
  batch.cell_start = out.cell_start.data();
  batch.sorted_points = out.points.data();
  launch(exec, "fill_grid", fill_grid, {grid, kThreads}, batch);
  const auto squares = exec.filled<unsigned long long>(count, 0);
  launch(exec, "measure_density", measure_density, {grid, kThreads}, segments.on_device.data(),
         cells.rank.data(), out.cell_start.data(), squares.data());
  const unsigned long long* sums = exec.download(squares.data(), count);
  exec.synchronize();
  for (std::size_t c = 0; c < count; ++c)
    pipeline::check_density(static_cast<double>(sums[c]), segments.size(c), options);
  return out;
}

}  // namespace gpureg::cuda
