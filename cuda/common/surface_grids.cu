// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/common/surface_grids.hpp"

#include "cuda/device/group_by_cell.cuh"
#include "cuda/device/hash_table.cuh"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

struct CellOfSurfacePoint {
  const SurfaceArrays* surfaces;
  const SurfaceGridView* views;
  __device__ bool operator()(std::uint32_t s, std::uint32_t i, Cell& cell) const {
    const Vec3 p = row_of(surfaces[s].points, i);
    if (!usable(p, row_of(surfaces[s].normals, i))) return false;
    cell = surface_cell(views[s], p);
    return true;
  }
};

struct Fill {
  const std::uint32_t* offset;
  const std::uint32_t* item;
  const std::uint32_t* rank;
  const std::uint32_t* start;
  const SurfaceArrays* surfaces;
  const SurfaceGridView* views;
  SurfaceCell* table;
  const std::size_t* table_offset;
  SurfacePoint* points;
  SurfaceNormal* normals;
};

/// Points in the order of the cells, and the table. Points without a cell come last.
__global__ void fill_surface_grids(Fill f) {
  const std::uint32_t s = blockIdx.y, begin = f.offset[s], end = f.offset[s + 1];
  const SurfaceArrays& surface = f.surfaces[s];
  for (std::uint32_t k = begin + blockIdx.x * blockDim.x + threadIdx.x; k < begin + surface.usable;
       k += gridDim.x * blockDim.x) {
    const std::uint32_t i = f.item[k];
    const Vec3 p = row_of(surface.points, i);
    f.points[k] = {p, i};
    f.normals[k] = {row_of(surface.normals, i), surface.variances[i]};
    const std::uint32_t group = f.rank[k];
    if (f.rank[k + 1] == group) continue;  // not the first of its cell
    const std::uint32_t last =
        group + 1 < f.rank[end] ? f.start[group + 1] - begin : surface.usable;
    SurfaceCell* table = f.table + f.table_offset[s];
    const std::uint32_t size =
        static_cast<std::uint32_t>(f.table_offset[s + 1] - f.table_offset[s]);
    const std::uint64_t key = cell_key(surface_cell(f.views[s], p));
    SurfaceCell& cell = table[claim_slot(table, size, key)];
    cell.first = k - begin;
    cell.last = last;
  }
}

}  // namespace

SurfaceGrids build_surface_grids(Exec& exec, Span<const SurfaceArrays> on_host,
                                 const SurfaceArrays* on_device, float distance) {
  constexpr unsigned kThreads = 256;
  const std::size_t count = on_host.size;
  const Segments segments =
      make_segments(exec, count, [&](std::size_t s) { return on_host[s].size; });
  std::vector<SurfaceGridView> views;
  std::vector<CellRange> ranges;
  for (const SurfaceArrays& surface : on_host) {
    views.push_back(surface_grid_of(surface, distance));
    ranges.push_back(
        {surface_cell(views.back(), surface.low), surface_cell(views.back(), surface.high)});
  }
  const auto bounds = exec.upload(views);
  const Groups cells =
      group_by_cell(exec, segments, ranges, CellOfSurfacePoint{on_device, bounds.data()});
  const std::uint32_t* cell_offset = download_group_offsets(exec, segments, cells);
  exec.synchronize();

  std::vector<std::size_t> table_offset{0};
  for (std::size_t s = 0; s < count; ++s)
    table_offset.push_back(table_offset.back() + table_size(cell_offset[s + 1] - cell_offset[s]));
  const auto table_offset_on_device = exec.upload(table_offset);
  SurfaceGrids out;
  out.table = exec.filled<SurfaceCell>(table_offset.back(), 0xff);
  out.points = exec.buffer<SurfacePoint>(segments.total());
  out.normals = exec.buffer<SurfaceNormal>(segments.total());
  for (std::size_t s = 0; s < count; ++s) {
    views[s].table = {out.table.data() + table_offset[s], table_offset[s + 1] - table_offset[s]};
    views[s].points = out.points.data() + segments.offset[s];
    views[s].normals = out.normals.data() + segments.offset[s];
  }
  out.views = exec.upload(views);
  if (segments.total() == 0) return out;
  const Fill batch{segments.on_device.data(),
                   cells.item.data(),
                   cells.rank.data(),
                   cells.start.data(),
                   on_device,
                   out.views.data(),
                   out.table.data(),
                   table_offset_on_device.data(),
                   out.points.data(),
                   out.normals.data()};
  launch(exec, "fill_surface_grids", fill_surface_grids,
         {{std::max(1u, std::min(blocks_for(segments.largest, kThreads), 1024u)),
           static_cast<unsigned>(count)},
          kThreads},
         batch);
  return out;
}

}  // namespace gpureg::cuda
