// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/find_points.hpp"

#include "cuda/common/closest_cells.cuh"
#include "cuda/device/launch.cuh"
#include "cuda/gpu.hpp"

namespace gpureg::test {
namespace {

__global__ void find(CloudView cloud, cuda::CellSummaries cells, const Vec3* locations,
                     std::uint32_t size, float max_squared, Found* out) {
  const std::uint32_t k = blockIdx.x * blockDim.x + threadIdx.x;
  if (k >= size) return;
  const cuda::FoundPoint found = cuda::find_point(cloud, cells, locations[k], max_squared);
  const std::uint32_t index = found.found() ? found.index_in(cells) : kNoValue;
  out[k] = {index, found.squared_distance, found.point,
            found.normal ==
                (found.found() ? cuda::pack_normal(cloud.normals[index]) : cuda::kPackedZero)};
}

}  // namespace

std::vector<Found> find_points(cuda::Exec& exec, const cuda::CudaCloud& cloud,
                               const std::vector<Vec3>& locations, float max_squared) {
  const auto on_device = exec.upload(locations);
  const auto out = exec.buffer<Found>(locations.size());
  cuda::launch(exec, "find", find, cuda::shape_for(locations.size(), 128), cloud.view_on_device,
               cloud.summaries, on_device.data(), static_cast<std::uint32_t>(locations.size()),
               max_squared, out.data());
  return host(exec, out.data(), locations.size());
}

ListCounts count_lists(cuda::Exec& exec, const cuda::CudaCloud& cloud) {
  ListCounts counts;
  const cuda::CellSummaries& cells = cloud.summaries;
  if (cells.nx == 0) return counts;
  const uint2 last = host(exec, cells.run + cells.brick_runs(), 1)[0];
  for (const uint2 block : host(exec, cells.block, last.y))
    ++counts.bricks[block.x >> 31 | block.y >> 31 << 1];
  constexpr std::size_t kBrickCells = ClosestGridView::kBlockCells / 4;
  for (const uint2 cell : host(exec, cells.cell, last.y * kBrickCells))
    counts.long_lists += (cell.y & 255u) == cuda::kLongList;
  return counts;
}

}  // namespace gpureg::test
