// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/visibility.hpp"

#include <algorithm>

#include "cuda/common/stages.hpp"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

/// Maps per pass: the atomics need 32-bit cells, a quarter of a megabyte per map.
constexpr std::uint32_t kMapsAtOnce = 1024;

struct MapBatch {
  const std::uint32_t* offset;  // of the raw clouds' points
  const RawSlot* slots;
  const std::uint32_t* cloud;  // of each map
  const Vec3* viewpoints;
  std::uint32_t first;  // map of this batch
  float inverse_step;
  std::uint32_t* nearest;  // maps of this batch x kMapCells
  std::uint16_t* depth;    // all maps x kMapCells
};

__global__ void draw_points(MapBatch m) {
  const std::uint32_t map = m.first + blockIdx.y, c = m.cloud[map],
                      size = m.offset[c + 1] - m.offset[c];
  const RawSlot slot = m.slots[c];
  const Vec3 viewpoint = m.viewpoints[map];
  std::uint32_t* nearest = m.nearest + static_cast<std::size_t>(blockIdx.y) * kMapCells;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < size;
       i += gridDim.x * blockDim.x) {
    const Vec3 d = slot.points[i] - slot.origin - viewpoint;
    if (!all_finite(d) || is_zero(d)) continue;
    const MapRay ray = map_ray(d);
    const std::uint32_t depth = map_depth(ray.depth, m.inverse_step);
    // A stale value is only ever greater than the current one.
    if (depth < nearest[ray.cell]) atomicMin(nearest + ray.cell, depth);
  }
}

__global__ void erode_maps(MapBatch m) {
  const std::uint32_t cell = blockIdx.x * blockDim.x + threadIdx.x;
  if (cell >= kMapCells) return;
  m.depth[static_cast<std::size_t>(m.first + blockIdx.y) * kMapCells + cell] =
      eroded_depth(m.nearest + static_cast<std::size_t>(blockIdx.y) * kMapCells, cell);
}

}  // namespace

DepthMaps build_depth_maps(Exec& exec, Span<const RawCloud> raw, const DownsampledClouds& clouds,
                           const PrepareSettings& options) {
  const std::size_t entries = clouds.segments.entries();
  DepthMaps out;
  std::vector<Vec3> viewpoints;
  std::vector<std::uint32_t> cloud_of_map;
  out.offset.push_back(0);
  for (std::size_t c = 0; c < entries; ++c) {
    const std::vector<Vec3>& all = clouds.facts[c].viewpoints;
    const std::size_t known = clouds.segments.size(c) == 0 ? 0 : all.size();
    const std::size_t count =
        map_count(known, options.depth_maps, raw[c].viewpoint_count > 0, raw[c].normals != nullptr);
    for (std::size_t k = 0; k < count; ++k) {
      viewpoints.push_back(all[chosen_viewpoint(k, count, known)]);
      cloud_of_map.push_back(static_cast<std::uint32_t>(c));
    }
    out.offset.push_back(static_cast<std::uint32_t>(viewpoints.size()));
  }
  out.step =
      depth_step(options.voxel_size > 0 ? options.voxel_size : options.max_correspondence_distance);
  const std::uint32_t maps = out.offset.back();
  if (maps == 0) return out;
  out.viewpoints = exec.upload(viewpoints);
  out.depth = exec.buffer<std::uint16_t>(std::size_t(maps) * kMapCells);
  const auto cloud_on_device = exec.upload(cloud_of_map);
  for (std::uint32_t first = 0; first < maps; first += kMapsAtOnce) {
    const std::uint32_t count = std::min(kMapsAtOnce, maps - first);
    // All bits set: greater than every depth, and unknown when cut to 16 bits.
    const auto nearest = exec.filled<std::uint32_t>(std::size_t(count) * kMapCells, 0xff);
    MapBatch batch{};
    batch.offset = clouds.raw.segments.on_device.data();
    batch.slots = clouds.raw.slots.data();
    batch.cloud = cloud_on_device.data();
    batch.viewpoints = out.viewpoints.data();
    batch.first = first;
    batch.inverse_step = 1.0f / out.step;
    batch.nearest = nearest.data();
    batch.depth = out.depth.data();
    launch(
        exec, "draw_points", draw_points,
        {{std::max(1u, std::min(blocks_for(clouds.raw.segments.largest, 256), 64u)), count}, 256},
        batch);
    launch(exec, "erode_maps", erode_maps, shape_for(kMapCells, 256, count), batch);
  }
  return out;
}

}  // namespace gpureg::cuda
