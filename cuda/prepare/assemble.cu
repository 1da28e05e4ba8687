// SPDX-License-Identifier: BSD-3-Clause
#include <initializer_list>
#include <type_traits>

#include "algorithm/normal_weight.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/device/launch.cuh"
#include "cuda/device/warp.cuh"
#include "cuda/prepare/feature_aids.hpp"
#include "cuda/prepare/scoring_data.hpp"

namespace gpureg::cuda {
namespace {

/// One array to copy into the memory of a cloud.
struct Part {
  const char* from;
  char* to;
  std::size_t bytes;
};

/// An array in a piece of memory that does not exist yet.
template <typename T>
struct Place {
  std::size_t offset;  ///< bytes
  T* in(char* memory) const { return reinterpret_cast<T*>(memory + offset); }
};

__global__ void copy_parts(const Part* parts) {
  const Part part = parts[blockIdx.y];
  const std::size_t stride = static_cast<std::size_t>(gridDim.x) * blockDim.x,
                    first = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  const bool words = (reinterpret_cast<std::size_t>(part.from) | part.bytes) % 4 == 0;
  if (words) {
    for (std::size_t k = first; k < part.bytes / 4; k += stride)
      reinterpret_cast<std::uint32_t*>(part.to)[k] =
          reinterpret_cast<const std::uint32_t*>(part.from)[k];
  } else {
    for (std::size_t k = first; k < part.bytes; k += stride) part.to[k] = part.from[k];
  }
}

/// Counts of a cloud.
struct Counts {
  std::uint32_t features;               // missing
  std::uint32_t extreme, extreme_wide;  // features that are too long for the tensor cores
  // points by the direction of their normals; the last bin: without
  std::uint32_t normal_bin[kNormalBins];
};

__global__ void count(const std::uint32_t* offset, const Vec3* normals, const std::uint8_t* valid,
                      std::uint32_t* const* normal_weight, Counts* counts) {
  __shared__ std::uint32_t bins[kNormalBins];
  const std::uint32_t c = blockIdx.y, begin = offset[c], end = offset[c + 1];
  if (threadIdx.x < kNormalBins) bins[threadIdx.x] = 0;
  __syncthreads();
  std::uint32_t no_feature = 0;
  for (std::uint32_t i = begin + blockIdx.x * blockDim.x + threadIdx.x; i < end;
       i += gridDim.x * blockDim.x) {
    const std::uint32_t bin = normal_bin(normals[i]);
    normal_weight[c][i - begin] = bin;
    atomicAdd(bins + bin, 1u);
    no_feature += !valid[i];
  }
  no_feature = warp_sum(no_feature);
  if (threadIdx.x % 32 == 0 && no_feature > 0) atomicAdd(&counts[c].features, no_feature);
  __syncthreads();
  if (threadIdx.x < kNormalBins && bins[threadIdx.x] > 0)
    atomicAdd(counts[c].normal_bin + threadIdx.x, bins[threadIdx.x]);
}

/// Weights from the counts of the bins.
__global__ void weight_by_normals(const std::uint32_t* offset, const Counts* counts,
                                  std::uint32_t* const* normal_weight) {
  __shared__ std::uint32_t weight[kNormalBins];
  const std::uint32_t c = blockIdx.y, size = offset[c + 1] - offset[c];
  if (threadIdx.x < kNormalBins)
    weight[threadIdx.x] = normal_weight_in_bin(counts[c].normal_bin[threadIdx.x]);
  __syncthreads();
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < size;
       i += gridDim.x * blockDim.x)
    normal_weight[c][i] = weight[normal_weight[c][i]];
}

struct ToHost {
  void* to;
  const void* from;
  std::size_t bytes;
};

void copy_to_host(const CudaCloud& cloud, std::initializer_list<ToHost> arrays) {
  if (cloud.size == 0) return;
  const DeviceScope scope(cloud.data.memory()->device());
  // Synchronised data: any stream may read it, and this stream waits for no other.
  cudaStream_t stream = nullptr;
  check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), "cudaStreamCreateWithFlags");
  cudaError_t error = cudaSuccess;
  for (const ToHost& array : arrays)
    if (error == cudaSuccess)
      error = cudaMemcpyAsync(array.to, array.from, array.bytes, cudaMemcpyDeviceToHost, stream);
  if (error == cudaSuccess) error = cudaStreamSynchronize(stream);
  cudaStreamDestroy(stream);
  check(error, "copying a cloud to the host");
}

template <typename T>
std::vector<T> copy_back(const CudaCloud& cloud, const T* device, std::size_t size) {
  std::vector<T> host(size);
  if (size > 0) copy_to_host(cloud, {{host.data(), device, size * sizeof(T)}});
  return host;
}

}  // namespace

std::vector<Vec3> CudaCloud::copy_points() const {
  return copy_back(*this, view_on_device.points, size);
}
std::vector<Vec3> CudaCloud::copy_normals() const {
  return copy_back(*this, view_on_device.normals, size);
}
PointsAndNormals CudaCloud::copy_points_and_normals() const {
  PointsAndNormals out{std::vector<Vec3>(size), std::vector<Vec3>(size)};
  const std::size_t bytes = size * sizeof(Vec3);
  copy_to_host(*this, {{out.points.data(), view_on_device.points, bytes},
                       {out.normals.data(), view_on_device.normals, bytes}});
  return out;
}
std::vector<float> CudaCloud::copy_features() const {
  return tight_rows(
      copy_back(*this, view_on_device.features, std::size_t(size) * row_stride(feature_dimension)),
      feature_dimension);
}

std::vector<std::shared_ptr<CudaCloud>> assemble(
    Exec& exec, const DownsampledClouds& clouds, const DeviceBuffer<Vec3>& normals,
    const Features& features, const Features& wide_features, const ClosestGrids& closest,
    const DepthMaps& depth_maps, const SurfaceSides& surface_sides,
    const PrepareSettings& options) {
  const Segments& segments = clouds.segments;
  const std::size_t clouds_count = segments.entries();
  const auto counts = exec.filled<Counts>(clouds_count, 0);
  std::vector<std::shared_ptr<CudaCloud>> out;
  std::vector<Part> parts;
  std::vector<FeaturesToMeasure> features_to_measure;
  std::vector<std::uint32_t*> normal_weight;
  for (std::size_t c = 0; c < clouds_count; ++c) {
    auto cloud = std::make_shared<CudaCloud>();
    const CloudFacts& facts = clouds.facts[c];
    cloud->options = options;
    for (int k = 0; k < 3; ++k) cloud->origin[k] = facts.origin[k];
    cloud->size = segments.size(c);
    cloud->feature_dimension = features.dimension[c];
    cloud->radius = facts.radius;
    cloud->viewpoints = facts.viewpoints;
    cloud->statistics.input_points = facts.input_points;
    cloud->statistics.invalid_points = facts.invalid_points;
    cloud->statistics.points = cloud->size;

    // First the offsets, then the memory, then the pointers.
    const std::size_t first_part = parts.size();
    std::size_t bytes = 0;
    const auto reserve = [&](std::size_t more) {
      const std::size_t at = bytes;
      bytes += (more + 255) / 256 * 256;
      return at;
    };
    // A part whose place is known before the memory is.
    const auto copy_to = [&](std::size_t at, const auto* from, std::size_t size) {
      parts.push_back(
          {reinterpret_cast<const char*>(from), reinterpret_cast<char*>(at), size * sizeof(*from)});
    };
    const auto place = [&](const auto* from, std::size_t size) {
      const std::size_t at = reserve(size * sizeof(*from));
      copy_to(at, from, size);
      return Place<std::remove_pointer_t<decltype(from)>>{at};
    };
    const std::size_t begin = segments.offset[c], n = cloud->size;
    const ClosestGridSize& grid_size = closest.size[c];
    const ScoringLayout layout = scoring_layout(cloud->size, grid_size, closest.block_range[c]);
    const auto points = place(clouds.points.data() + begin, n);
    const auto own_normals = place(normals.data() + begin, n);
    const auto has_feature = place(features.valid.data() + begin, n);
    // The hash table serves clouds without a table of bricks.
    const bool hashed = !layout.has_table();
    constexpr std::size_t kStarts = ClosestGridView::kBlockCells + 1;
    const std::size_t table_size =
                          hashed ? closest.table_offset[c + 1] - closest.table_offset[c] : 0,
                      starts = hashed ? grid_size.blocks * kStarts : 0,
                      candidates = hashed ? grid_size.candidates : 0;
    const auto table = place(closest.table.data() + closest.table_offset[c], table_size);
    const auto cell_start =
        place(closest.cell_start.data() + closest.blocks.offset[c] * kStarts, starts);
    const auto candidate =
        place(closest.candidates.data() + closest.candidate_offset[c], candidates);
    const bool has_wide = wide_features.dimension[c] > 0 && n > 0;
    const auto wide_valid =
        place(wide_features.valid.data() + (has_wide ? begin : 0), has_wide ? n : 0);
    const std::uint32_t map_begin = depth_maps.offset[c],
                        maps = depth_maps.offset[c + 1] - map_begin;
    const auto depth = place(depth_maps.depth.data() + std::size_t(map_begin) * kMapCells,
                             std::size_t(maps) * kMapCells);
    const auto viewpoints = place(depth_maps.viewpoints.data() + map_begin, maps);
    const SurfaceSideGrid& box = surface_sides.boxes[c];
    const auto side_words =
        place(surface_sides.words.data() + surface_sides.offset[c], box.words());
    // Space for the arrays that are computed in place.
    const HalfCopy copy = facts.feature_dimension == 0 ? HalfCopy::turned : HalfCopy::plain;
    const auto reserve_aids = [&](std::uint32_t dimension, HalfCopy copy_of) {
      FeatureAidsPlaces at{};
      for (int k = 0; k < FeatureAidsPlaces::kArrays; ++k)
        at.begin[k] = reserve(feature_aids_bytes(k, n, dimension, copy_of));
      return at;
    };
    const float* const narrow_rows = features.values.data() + features.offset[c];
    const float* const wide_rows = wide_features.values.data() + wide_features.offset[c];
    const std::uint32_t wide_dimension = has_wide ? wide_features.dimension[c] : 0;
    const auto reserve_rows = [&](std::uint32_t dimension) {
      return Place<float>{reserve(n * row_stride(dimension) * sizeof(float))};
    };
    const auto narrow = reserve_rows(cloud->feature_dimension);
    const auto wide = reserve_rows(wide_dimension);
    if (half_width(cloud->feature_dimension, copy) == 0)
      copy_to(narrow.offset, narrow_rows, n * cloud->feature_dimension);
    const auto aids = reserve_aids(cloud->feature_dimension, copy);
    const auto wide_aids = reserve_aids(wide_dimension, HalfCopy::turned);
    const Place<std::uint32_t> weights{reserve(n * sizeof(std::uint32_t))};
    const std::size_t copied = bytes;
    // Filled: tables start empty, and gaps between the arrays are copied with them.
    cloud->data = exec.filled<char>(copied + layout.bytes, 0);
    char* const memory = cloud->data.data();
    for (std::size_t k = first_part; k < parts.size(); ++k)
      parts[k].to = memory + reinterpret_cast<std::size_t>(parts[k].to);
    CloudView& view = cloud->view_on_device;
    view.points = points.in(memory);
    view.normals = own_normals.in(memory);
    view.has_feature = has_feature.in(memory);
    view.size = cloud->size;
    view.feature_dimension = cloud->feature_dimension;
    view.radius = cloud->radius;
    view.closest = {1.0f / closest.geometry[c].cell_size,
                    {table.in(memory), table_size},
                    {cell_start.in(memory), starts},
                    {candidate.in(memory), candidates}};
    view.executor_data = cloud.get();
    view.has_wide_feature = has_wide ? wide_valid.in(memory) : nullptr;
    view.visibility = {depth.in(memory), viewpoints.in(memory), maps, depth_maps.step};
    view.surface_sides = {box, box.words() > 0 ? side_words.in(memory) : nullptr};
    float* const narrow_to = narrow.in(memory);
    float* const wide_to = wide.in(memory);
    view.features = narrow_to;
    view.wide_features = has_wide ? wide_to : nullptr;
    normal_weight.push_back(weights.in(memory));
    view.normal_weight = normal_weight.back();
    const auto measure = [&](FeatureAids& to, const FeatureAidsPlaces& at, HalfCopy copy_of,
                             const float* rows, float* padded, const std::uint8_t* valid,
                             std::uint32_t dimension, std::uint32_t* extreme) {
      if (half_width(dimension, copy_of) == 0) return;
      to = feature_aids_at(memory, at, copy_of);
      features_to_measure.push_back({rows, padded, valid, view.size, dimension, to, extreme});
    };
    measure(cloud->narrow_aids, aids, copy, narrow_rows, narrow_to, view.has_feature,
            view.feature_dimension, &counts.data()[c].extreme);
    if (has_wide)
      measure(cloud->wide_aids, wide_aids, HalfCopy::turned, wide_rows, wide_to,
              view.has_wide_feature, wide_dimension, &counts.data()[c].extreme_wide);
    place_scoring_data(layout, closest.geometry[c], memory + copied, *cloud);
    out.push_back(std::move(cloud));
  }
  const auto parts_on_device = exec.upload(parts);
  launch(exec, "copy_parts", copy_parts, {{16, static_cast<unsigned>(parts.size())}, 256},
         parts_on_device.data());
  const auto normal_weight_on_device = exec.upload(normal_weight);
  const dim3 grid(8, static_cast<unsigned>(clouds_count));
  launch(exec, "count", count, {grid, 256}, segments.on_device.data(), normals.data(),
         features.valid.data(), normal_weight_on_device.data(), counts.data());
  launch(exec, "weight_by_normals", weight_by_normals, {grid, 256}, segments.on_device.data(),
         counts.data(), normal_weight_on_device.data());
  fill_feature_aids(exec, features_to_measure);
  fill_scoring_data(exec, out, closest);
  const Counts* counted = exec.download(counts.data(), clouds_count);
  exec.synchronize();
  for (std::size_t c = 0; c < clouds_count; ++c) {
    CudaCloud& cloud = *out[c];
    cloud.statistics.points_without_normal = counted[c].normal_bin[kNormalBins - 1];
    cloud.statistics.points_without_feature = counted[c].features;
    for (const std::uint32_t points : counted[c].normal_bin)
      cloud.normal_weight_total += std::uint64_t(points) * normal_weight_in_bin(points);
    cloud.view_on_device.normal_weight_total = cloud.normal_weight_total;
    if (counted[c].extreme > 0) cloud.narrow_aids.half = nullptr;
    if (counted[c].extreme_wide > 0) cloud.wide_aids.half = nullptr;
  }
  return out;
}

}  // namespace gpureg::cuda
