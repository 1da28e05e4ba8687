// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/common/stages.hpp"
#include "cuda/device/group_by_cell.cuh"
#include "cuda/device/hash_table.cuh"
#include "cuda/device/launch.cuh"
#include "cuda/prepare/closest_lists.hpp"

namespace gpureg::cuda {
namespace {

/// Blocks with a location within the search distance of a point: corner k of `edge`^3.
__device__ bool reachable_block(const ClosestGeometry& g, Vec3 p, std::uint32_t corner,
                                std::uint32_t edge, Cell& block) {
  const float inverse = 1.0f / block_edge(g), reach = point_reach(g);
  const Cell lo = cell_of({p.x - reach, p.y - reach, p.z - reach}, inverse);
  const Cell hi = cell_of({p.x + reach, p.y + reach, p.z + reach}, inverse);
  const std::int32_t dx = static_cast<std::int32_t>(corner % edge),
                     dy = static_cast<std::int32_t>(corner / edge % edge),
                     dz = static_cast<std::int32_t>(corner / (edge * edge));
  block = {lo.x + dx, lo.y + dy, lo.z + dz};
  return block.x <= hi.x && block.y <= hi.y && block.z <= hi.z;
}

struct BlockOfCorner {
  const std::uint32_t* offset;
  const Vec3* points;
  const ClosestGeometry* geometry;
  std::uint32_t edge;
  __device__ bool operator()(std::uint32_t c, std::uint32_t item, Cell& block) const {
    const std::uint32_t corners = edge * edge * edge;
    return reachable_block(geometry[c], points[offset[c] + item / corners], item % corners, edge,
                           block);
  }
};

__global__ void write_blocks(const std::uint32_t* block_offset, BlockOfCorner block_of,
                             const std::uint32_t* item, const std::uint32_t* start,
                             const std::size_t* table_offset, Cell* blocks, CellEntry* table) {
  const std::uint32_t c = blockIdx.y, first = block_offset[c], count = block_offset[c + 1] - first;
  for (std::uint32_t b = blockIdx.x * blockDim.x + threadIdx.x; b < count;
       b += gridDim.x * blockDim.x) {
    Cell block;
    block_of(c, item[start[first + b]], block);
    blocks[first + b] = block;
    insert_key(table + table_offset[c],
               static_cast<std::uint32_t>(table_offset[c + 1] - table_offset[c]), cell_key(block),
               b);
  }
}

}  // namespace

ClosestGrids build_closest_grids(Exec& exec, const DownsampledClouds& clouds, const Grids& grids,
                                 const PrepareSettings& options) {
  const Segments& points = clouds.segments;
  const std::size_t count = points.entries();
  ClosestGrids out;
  // The search distance is less than half a block unless the margin for rounding grows, in a cloud
  // that is very wide for it.
  std::uint32_t edge = 2;
  for (const CloudFacts& facts : clouds.facts) {
    const ClosestGeometry g = closest_geometry(options.max_correspondence_distance, facts.radius);
    out.geometry.push_back(g);
    const float inverse = 1.0f / block_edge(g), reach = point_reach(g);
    edge = std::max(edge, static_cast<std::uint32_t>(2.0f * reach * inverse) + 2);
    const Cell lo = cell_of({facts.lo.x - reach, facts.lo.y - reach, facts.lo.z - reach}, inverse);
    const Cell hi = cell_of({facts.hi.x + reach, facts.hi.y + reach, facts.hi.z + reach}, inverse);
    out.block_range.push_back({{lo.x - 1, lo.y - 1, lo.z - 1}, {hi.x + 1, hi.y + 1, hi.z + 1}});
  }
  const auto geometry = exec.upload(out.geometry);
  const std::uint64_t corners = std::uint64_t(edge) * edge * edge;
  const Segments corner_segments =
      make_segments(exec, count, [&](std::size_t c) { return points.size(c) * corners; });
  const BlockOfCorner block_of{points.on_device.data(), clouds.points.data(), geometry.data(),
                               edge};
  const Groups groups = group_by_cell(exec, corner_segments, out.block_range, block_of);
  const std::uint32_t* block_offsets = download_group_offsets(exec, corner_segments, groups);
  exec.synchronize();

  out.blocks =
      segments_of(exec, std::vector<std::uint32_t>(block_offsets, block_offsets + count + 1));
  out.table_offset.push_back(0);
  for (std::size_t c = 0; c < count; ++c)
    out.table_offset.push_back(out.table_offset.back() + table_size(out.blocks.size(c)));
  const auto table_offset = exec.upload(out.table_offset);
  out.table = exec.filled<CellEntry>(out.table_offset.back(), 0xff);
  out.block = exec.buffer<Cell>(out.blocks.total());
  launch(exec, "write_blocks", write_blocks,
         {{std::max(1u, std::min(blocks_for(out.blocks.largest, 128), 1024u)),
           static_cast<unsigned>(count)},
          128},
         out.blocks.on_device.data(), block_of, groups.item.data(), groups.start.data(),
         table_offset.data(), out.block.data(), out.table.data());
  fill_closest_lists(exec, clouds, grids, geometry.data(), options, out);
  return out;
}

}  // namespace gpureg::cuda
