// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "algorithm/normal.hpp"
#include "algorithm/voxel.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/device/group_by_cell.cuh"
#include "cuda/device/launch.cuh"
#include "cuda/device/warp.cuh"
#include "cuda/prepare/average_voxels.hpp"
#include "pipeline/checks.hpp"

namespace gpureg::cuda {
namespace {

/// Floats as integers of the same order, for atomicMin and atomicMax. -0 sorts before 0;
/// local_origin treats them alike.
__host__ __device__ std::int32_t ordered(std::int32_t bits) {
  return bits ^ ((bits >> 31) & 0x7fffffff);
}

__global__ void measure_box(const std::uint32_t* offset, const RawSlot* slots, Extent* extents) {
  const std::uint32_t c = blockIdx.y, size = offset[c + 1] - offset[c];
  std::int32_t lo[3] = {0x7fffffff, 0x7fffffff, 0x7fffffff},
               hi[3] = {-0x7fffffff, -0x7fffffff, -0x7fffffff};
  std::uint32_t finite = 0;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < size;
       i += gridDim.x * blockDim.x) {
    const Vec3 p = slots[c].points[i];
    if (!all_finite(p)) continue;
    ++finite;
    const float v[3] = {p.x, p.y, p.z};
    for (int k = 0; k < 3; ++k) {
      const std::int32_t o = ordered(__float_as_int(v[k]));
      lo[k] = min(lo[k], o);
      hi[k] = max(hi[k], o);
    }
  }
  finite = warp_sum(finite);
  for (int k = 0; k < 3; ++k) {
    lo[k] = warp_min(lo[k]);
    hi[k] = warp_max(hi[k]);
  }
  if (threadIdx.x % 32 != 0 || finite == 0) return;
  atomicAdd(&extents[c].finite, finite);
  for (int k = 0; k < 3; ++k) {
    atomicMin(&extents[c].lo[k], lo[k]);
    atomicMax(&extents[c].hi[k], hi[k]);
  }
}

__global__ void measure_radius(const std::uint32_t* offset, const RawSlot* slots, Extent* extents) {
  const std::uint32_t c = blockIdx.y, size = offset[c + 1] - offset[c];
  std::uint32_t largest = 0;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < size;
       i += gridDim.x * blockDim.x) {
    const Vec3 p = slots[c].points[i];
    if (all_finite(p)) largest = max(largest, __float_as_uint(squared_norm(p - slots[c].origin)));
  }
  largest = warp_max(largest);
  if (threadIdx.x % 32 == 0 && largest > 0) atomicMax(&extents[c].largest_squared_norm, largest);
}

/// Voxel of a raw point, or its index without downsampling.
struct VoxelOf {
  const RawSlot* slots;
  float inverse;  // 0: no downsampling
  __device__ bool operator()(std::uint32_t c, std::uint32_t i, Cell& cell) const {
    const Vec3 p = slots[c].points[i];
    if (!all_finite(p)) return false;
    cell = inverse > 0 ? voxel_of(p - slots[c].origin, inverse)
                       : Cell{static_cast<std::int32_t>(i & 0xfffffu),
                              static_cast<std::int32_t>(i >> 20), 0};
    return true;
  }
};

float from_bits(std::uint32_t bits) {
  float v;
  std::memcpy(&v, &bits, sizeof v);
  return v;
}

/// Uploads the raw clouds of host memory into one buffer; clouds in device memory stay in place.
DeviceBuffer<float> upload_raw(Exec& exec, Span<const RawCloud> clouds,
                               std::vector<RawSlot>& slots) {
  const auto floats = [](const RawCloud& raw) {
    return raw.size * (3 + (raw.normals ? 3 : 0) + (raw.features ? raw.feature_dimension : 0));
  };
  std::size_t total = 0;
  for (const RawCloud& raw : clouds)
    if (!raw.on_device) total += floats(raw);
  auto device = exec.buffer<float>(total);
  std::vector<RowsToUpload> parts;
  float* at = device.data();
  const auto place = [&](const float* rows, std::size_t count, std::size_t width,
                         std::size_t stride, bool is_there) -> const float* {
    if (!rows || count == 0 || is_there) return count == 0 ? nullptr : rows;
    parts.push_back({rows, count, width, stride, at});
    at += count * width;
    return parts.back().device;
  };
  for (std::size_t c = 0; c < clouds.size; ++c) {
    const RawCloud& raw = clouds[c];
    RawSlot slot{};
    slot.points = reinterpret_cast<const Vec3*>(
        place(raw.points, raw.size, 3, raw.point_stride, raw.on_device));
    slot.normals = reinterpret_cast<const Vec3*>(
        place(raw.normals, raw.size, 3, raw.normal_stride, raw.on_device));
    slot.features =
        place(raw.features, raw.size, raw.feature_dimension, raw.feature_stride, raw.on_device);
    slot.dimension = slot.features ? static_cast<std::uint32_t>(raw.feature_dimension) : 0;
    slots.push_back(slot);
  }
  exec.uploader().upload(span_of(parts), exec.device(), exec.stream());
  return device;
}

CloudFacts facts_of(const RawCloud& raw, const Extent& extent, const PrepareSettings& options) {
  CloudFacts facts;
  facts.input_points = raw.size;
  facts.invalid_points = raw.size - extent.finite;
  float lo[3] = {0, 0, 0}, hi[3] = {0, 0, 0};
  for (int k = 0; k < 3 && extent.finite > 0; ++k) {
    lo[k] = from_bits(static_cast<std::uint32_t>(ordered(extent.lo[k])));
    hi[k] = from_bits(static_cast<std::uint32_t>(ordered(extent.hi[k])));
    facts.origin[k] = local_origin(lo[k], hi[k], options.voxel_size);
  }
  const Vec3 origin{facts.origin[0], facts.origin[1], facts.origin[2]};
  if (extent.finite > 0)
    facts.lo = Vec3{lo[0], lo[1], lo[2]} - origin, facts.hi = Vec3{hi[0], hi[1], hi[2]} - origin;
  for (std::size_t k = 0; k < raw.viewpoint_count; ++k)
    facts.viewpoints.push_back(
        Vec3{raw.viewpoints[3 * k], raw.viewpoints[3 * k + 1], raw.viewpoints[3 * k + 2]} - origin);
  facts.turns_normals =
      turns_normals(raw.normals != nullptr, raw.viewpoint_count, options.depth_maps);
  if (facts.viewpoints.empty()) facts.viewpoints.push_back(-origin);
  facts.feature_dimension = raw.features ? static_cast<std::uint32_t>(raw.feature_dimension) : 0;
  facts.has_guides = raw.normals != nullptr;
  return facts;
}

/// Voxel range of a box. A box that is too wide fails the check of the radius later; until then the
/// range only must not overflow.
CellRange voxel_range(const CloudFacts& facts, std::size_t raw_size, float voxel_size) {
  if (!(voxel_size > 0))
    return {
        {0, 0, 0},
        {limits::kMaxCells - 1, static_cast<std::int32_t>(raw_size >> (limits::kCellBits - 1)), 0}};
  const auto clamped = [](float v) {
    return std::max(-static_cast<float>(limits::kMaxCells),
                    std::min(static_cast<float>(limits::kMaxCells - 1), v));
  };
  const float inverse = 1.0f / voxel_size;
  const auto cell = [&](Vec3 p) {
    return Cell{floor_to_int(clamped(p.x * inverse)), floor_to_int(clamped(p.y * inverse)),
                floor_to_int(clamped(p.z * inverse))};
  };
  return {cell(facts.lo), cell(facts.hi)};
}

}  // namespace

DownsampledClouds downsample(Exec& exec, Span<const RawCloud> clouds,
                             const PrepareSettings& options) {
  constexpr unsigned kThreads = 256;
  std::vector<RawSlot> slots;
  auto raw_data = upload_raw(exec, clouds, slots);
  Segments raw = make_segments(exec, clouds.size, [&](std::size_t c) { return clouds[c].size; });
  const dim3 grid(std::max(1u, std::min(blocks_for(raw.largest, kThreads), 256u)),
                  static_cast<unsigned>(clouds.size));

  constexpr std::int32_t kMost = 0x7fffffff;
  std::vector<Extent> empty(clouds.size,
                            Extent{{kMost, kMost, kMost}, {-kMost, -kMost, -kMost}, 0, 0});
  auto extents = exec.upload(empty);
  {
    const auto slots_on_device = exec.upload(slots);
    launch(exec, "measure_box", measure_box, {grid, kThreads}, raw.on_device.data(),
           slots_on_device.data(), extents.data());
  }
  const Extent* boxes = exec.download(extents.data(), clouds.size);
  exec.synchronize();

  DownsampledClouds out;
  std::vector<CellRange> ranges;
  bool any_guides = false;
  for (std::size_t c = 0; c < clouds.size; ++c) {
    out.facts.push_back(facts_of(clouds[c], boxes[c], options));
    slots[c].origin = {out.facts[c].origin[0], out.facts[c].origin[1], out.facts[c].origin[2]};
    ranges.push_back(voxel_range(out.facts[c], clouds[c].size, options.voxel_size));
    any_guides = any_guides || out.facts[c].has_guides;
  }
  auto slots_on_device = exec.upload(slots);
  launch(exec, "measure_radius", measure_radius, {grid, kThreads}, raw.on_device.data(),
         slots_on_device.data(), extents.data());
  const Groups voxels = group_by_cell(
      exec, raw, ranges,
      VoxelOf{slots_on_device.data(), options.voxel_size > 0 ? 1.0f / options.voxel_size : 0.0f});
  const std::uint32_t* voxel_offsets = download_group_offsets(exec, raw, voxels);
  const Extent* measured = exec.download(extents.data(), clouds.size);
  exec.synchronize();
  for (std::size_t c = 0; c < clouds.size; ++c)
    pipeline::check_extent(sqrtf(from_bits(measured[c].largest_squared_norm)), options);

  out.segments =
      segments_of(exec, std::vector<std::uint32_t>(voxel_offsets, voxel_offsets + clouds.size + 1));
  std::vector<std::size_t> feature_offset{0};
  for (std::size_t c = 0; c < clouds.size; ++c) {
    out.facts[c].feature_offset = feature_offset.back();
    feature_offset.push_back(feature_offset.back() +
                             static_cast<std::size_t>(out.segments.size(c)) *
                                 out.facts[c].feature_dimension);
  }
  out.points = exec.buffer<Vec3>(out.segments.total());
  if (any_guides) out.guides = exec.buffer<Vec3>(out.segments.total());
  out.features = exec.buffer<float>(feature_offset.back());
  const auto feature_offset_on_device = exec.upload(feature_offset);
  const auto largest = exec.filled<std::uint32_t>(clouds.size, 0);
  Average averages{};
  averages.raw_offset = raw.on_device.data();
  averages.offset = out.segments.on_device.data();
  averages.slots = slots_on_device.data();
  averages.extents = extents.data();
  averages.item = voxels.item.data();
  averages.start = voxels.start.data();
  averages.feature_offset = feature_offset_on_device.data();
  averages.points = out.points.data();
  averages.guides = out.guides.data();
  averages.features = out.features.data();
  averages.largest_squared_norm = largest.data();
  average_voxels(exec, averages, clouds.size, out.segments.largest, raw.total());
  const std::uint32_t* radii = exec.download(largest.data(), clouds.size);
  exec.synchronize();
  for (std::size_t c = 0; c < clouds.size; ++c)
    out.facts[c].radius = radii[c] > 0 ? sqrtf(from_bits(radii[c])) * kRadiusMargin : 1.0f;
  if (options.depth_maps > 0)
    out.raw = {std::move(raw_data), std::move(raw), std::move(slots_on_device)};
  return out;
}

}  // namespace gpureg::cuda
