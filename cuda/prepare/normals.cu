// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/normal.hpp"

#include <algorithm>

#include "cuda/common/stages.hpp"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

/// One thread per point, in cell order, so that a warp walks the same cells.
__global__ void orient_plane_normals(const std::uint32_t* offset, const GridView* grids,
                                     const Vec3* guides, const Span<const Vec3>* viewpoints,
                                     float radius, Vec3* normals) {
  const std::uint32_t c = blockIdx.y, begin = offset[c], size = offset[c + 1] - begin;
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= size) return;
  const GridView grid = grids[c];
  const Vec3 p = grid.points[i];
  const std::uint32_t at = begin + grid.index[i];
  const Vec3 guide = guides ? guides[at] : Vec3{0, 0, 0};
  normals[at] = orient_normal(plane_normal(grid, p, radius), p, guide, viewpoints[c]);
}

/// Marks the input normals that face away from all viewpoints, and counts them per cloud.
__global__ void find_backs(const std::uint32_t* offset, const Vec3* points, const Vec3* normals,
                           const Span<const Vec3>* viewpoints, const std::uint8_t* asks,
                           std::uint8_t* away, std::uint32_t* count) {
  const std::uint32_t c = blockIdx.y, i = offset[c] + blockIdx.x * blockDim.x + threadIdx.x;
  if (!asks[c] || i >= offset[c + 1]) return;
  away[i] = faces_away(normals[i], points[i], viewpoints[c]);
  if (away[i]) atomicAdd(count + c, 1u);
}

__global__ void turn_backs(const std::uint32_t* offset, const std::uint8_t* asks,
                           const std::uint8_t* away, const std::uint32_t* count, Vec3* normals) {
  const std::uint32_t c = blockIdx.y, i = offset[c] + blockIdx.x * blockDim.x + threadIdx.x;
  if (!asks[c] || i >= offset[c + 1] || !turns_back(count[c], offset[c + 1] - offset[c])) return;
  if (away[i]) normals[i] = -normals[i];
}

void turn_to_viewpoints(Exec& exec, const DownsampledClouds& clouds,
                        const Span<const Vec3>* viewpoints, Vec3* normals) {
  constexpr unsigned kThreads = 128;
  const Segments& segments = clouds.segments;
  std::vector<std::uint8_t> asks;
  for (const CloudFacts& facts : clouds.facts) asks.push_back(facts.turns_normals);
  if (std::find(asks.begin(), asks.end(), 1) == asks.end()) return;
  const auto asks_on_device = exec.upload(asks);
  const auto away = exec.buffer<std::uint8_t>(segments.total());
  const auto count = exec.filled<std::uint32_t>(segments.entries(), 0);
  const dim3 grid(blocks_for(segments.largest, kThreads),
                  static_cast<unsigned>(segments.entries()));
  launch(exec, "find_backs", find_backs, {grid, kThreads}, segments.on_device.data(),
         clouds.points.data(), normals, viewpoints, asks_on_device.data(), away.data(),
         count.data());
  launch(exec, "turn_backs", turn_backs, {grid, kThreads}, segments.on_device.data(),
         asks_on_device.data(), away.data(), count.data(), normals);
}

}  // namespace

DeviceBuffer<Vec3> estimate_normals(Exec& exec, const DownsampledClouds& clouds, const Grids& grids,
                                    float radius) {
  constexpr unsigned kThreads = 128;
  const Segments& segments = clouds.segments;
  auto normals = exec.buffer<Vec3>(segments.total());
  if (segments.total() == 0) return normals;
  std::vector<Vec3> all;
  for (const CloudFacts& facts : clouds.facts)
    all.insert(all.end(), facts.viewpoints.begin(), facts.viewpoints.end());
  const auto all_on_device = exec.upload(all);
  std::vector<Span<const Vec3>> viewpoints;
  std::size_t at = 0;
  for (const CloudFacts& facts : clouds.facts) {
    viewpoints.push_back({all_on_device.data() + at, facts.viewpoints.size()});
    at += facts.viewpoints.size();
  }
  const auto viewpoints_on_device = exec.upload(viewpoints);
  const dim3 grid(blocks_for(segments.largest, kThreads),
                  static_cast<unsigned>(segments.entries()));
  launch(exec, "orient_plane_normals", orient_plane_normals, {grid, kThreads},
         segments.on_device.data(), grids.views.data(), clouds.guides.data(),
         viewpoints_on_device.data(), radius, normals.data());
  turn_to_viewpoints(exec, clouds, viewpoints_on_device.data(), normals.data());
  return normals;
}

}  // namespace gpureg::cuda
