// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/normal.hpp"
#include "stages.hpp"

namespace gpureg::cuda {
namespace {

/// One thread per point, in cell order, so that a warp walks the same cells.
__global__ void orient_plane_normals(const std::uint32_t* offset, const GridView* grids, const Vec3* guides, const Span<const Vec3>* viewpoints,
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

}  // namespace

DeviceBuffer<Vec3> estimate_normals(Exec& exec, const DownsampledClouds& clouds, const Grids& grids, const PrepareOptions& options) {
  constexpr unsigned kThreads = 128;
  const Segments& segments = clouds.segments;
  auto normals = exec.buffer<Vec3>(segments.total());
  if (segments.total() == 0) return normals;
  std::vector<Vec3> all;
  for (const CloudFacts& facts : clouds.facts) all.insert(all.end(), facts.viewpoints.begin(), facts.viewpoints.end());
  const auto all_on_device = exec.upload(all);
  std::vector<Span<const Vec3>> viewpoints;
  std::size_t at = 0;
  for (const CloudFacts& facts : clouds.facts) {
    viewpoints.push_back({all_on_device.data() + at, facts.viewpoints.size()});
    at += facts.viewpoints.size();
  }
  const auto viewpoints_on_device = exec.upload(viewpoints);
  const dim3 grid(blocks_for(segments.largest, kThreads), static_cast<unsigned>(segments.entries()));
  orient_plane_normals<<<grid, kThreads, 0, exec.stream()>>>(segments.on_device.data(), grids.views.data(), clouds.guides.data(),
                                                             viewpoints_on_device.data(), options.normal_radius, normals.data());
  check_launch("orient_plane_normals");
  return normals;
}

}  // namespace gpureg::cuda
