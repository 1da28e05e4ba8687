// SPDX-License-Identifier: BSD-3-Clause
#include "nearest_feature.hpp"
#include "scoring_data.hpp"
#include "stages.hpp"
#include "warp.cuh"

namespace gpureg::cuda {
namespace {

/// One array on its way into a cloud's own memory.
struct Part {
  const char* from;
  char* to;
  std::size_t bytes;
};

__global__ void copy_parts(const Part* parts) {
  const Part part = parts[blockIdx.y];
  const std::size_t stride = static_cast<std::size_t>(gridDim.x) * blockDim.x, first = static_cast<std::size_t>(blockIdx.x) * blockDim.x + threadIdx.x;
  const bool words = (reinterpret_cast<std::size_t>(part.from) | part.bytes) % 4 == 0;
  if (words) {
    for (std::size_t k = first; k < part.bytes / 4; k += stride)
      reinterpret_cast<std::uint32_t*>(part.to)[k] = reinterpret_cast<const std::uint32_t*>(part.from)[k];
  } else {
    for (std::size_t k = first; k < part.bytes; k += stride) part.to[k] = part.from[k];
  }
}

struct Missing {
  std::uint32_t normals, features, extreme_features;
};

struct NormSlot {
  const float* features;
  const std::uint8_t* valid;
  std::uint32_t size, dimension, width;
  float2* out;
  std::uint32_t* tf32;  // null: none
  float* padded;
};

/// Rounded to 10 bits of mantissa, as the tensor cores take them; ties away from zero.
__device__ std::uint32_t to_tf32(float v) { return (__float_as_uint(v) + 0x1000u) & ~0x1fffu; }

/// What the feature search reads beside the features: their lengths, and copies for the tensor cores.
__global__ void measure_features(const NormSlot* slots, Missing* missing) {
  const NormSlot s = slots[blockIdx.y];
  std::uint32_t extreme = 0;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < s.size; i += gridDim.x * blockDim.x) {
    float sum = 0.0f;
    for (std::uint32_t d = 0; d < s.dimension; ++d) {
      const float v = s.features[static_cast<std::size_t>(i) * s.dimension + d];
      sum = fmaf(v, v, sum);
    }
    if (!s.valid[i]) sum = __uint_as_float(0x7f800000u);
    s.out[i] = make_float2(sum, sqrtf(sum));
    for (std::uint32_t d = 0; s.tf32 && d < s.width; ++d) {
      const float v = s.valid[i] && d < s.dimension ? s.features[static_cast<std::size_t>(i) * s.dimension + d] : 0.0f;
      s.tf32[static_cast<std::size_t>(i) * s.width + d] = to_tf32(v);
      s.padded[static_cast<std::size_t>(i) * s.width + d] = v;
    }
    extreme += s.valid[i] && !(sum < 1e30f);
  }
  if (extreme > 0) atomicAdd(&missing[blockIdx.y].extreme_features, extreme);
}

__global__ void count_missing(const std::uint32_t* offset, const Vec3* normals, const std::uint8_t* valid, Missing* missing) {
  const std::uint32_t c = blockIdx.y, end = offset[c + 1];
  std::uint32_t no_normal = 0, no_feature = 0;
  for (std::uint32_t i = offset[c] + blockIdx.x * blockDim.x + threadIdx.x; i < end; i += gridDim.x * blockDim.x) {
    no_normal += is_zero(normals[i]);
    no_feature += !valid[i];
  }
  no_normal = warp_sum(no_normal);
  no_feature = warp_sum(no_feature);
  if (threadIdx.x % 32 != 0) return;
  if (no_normal > 0) atomicAdd(&missing[c].normals, no_normal);
  if (no_feature > 0) atomicAdd(&missing[c].features, no_feature);
}

template <typename T>
std::vector<T> copy_back(const CudaCloud& cloud, const T* device, std::size_t size) {
  std::vector<T> host(size);
  if (size > 0) {
    const DeviceScope scope(cloud.data.memory()->device());
    // Finished data: any stream may read it, and this one waits for nobody else's work.
    cudaStream_t stream = nullptr;
    check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), "cudaStreamCreateWithFlags");
    cudaError_t error = cudaMemcpyAsync(host.data(), device, size * sizeof(T), cudaMemcpyDeviceToHost, stream);
    if (error == cudaSuccess) error = cudaStreamSynchronize(stream);
    cudaStreamDestroy(stream);
    check(error, "copying a cloud to the host");
  }
  return host;
}

}  // namespace

std::vector<Vec3> CudaCloud::copy_points() const { return copy_back(*this, view_on_device.points, size); }
std::vector<Vec3> CudaCloud::copy_normals() const { return copy_back(*this, view_on_device.normals, size); }
std::vector<float> CudaCloud::copy_features() const {
  return copy_back(*this, view_on_device.features, static_cast<std::size_t>(size) * feature_dimension);
}

std::vector<std::shared_ptr<CudaCloud>> assemble(Exec& exec, const DownsampledClouds& clouds, const DeviceBuffer<Vec3>& normals,
                                                 const Features& features, const ClosestGrids& closest, const PrepareOptions& options) {
  const Segments& segments = clouds.segments;
  const std::size_t count = segments.entries();
  std::vector<std::shared_ptr<CudaCloud>> out;
  std::vector<Part> parts;
  std::vector<NormSlot> norm_slots;
  for (std::size_t c = 0; c < count; ++c) {
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
    cloud->block_count = closest.blocks.size(c);
    cloud->candidate_count = closest.candidate_offset[c + 1] - closest.candidate_offset[c];

    // First the places, then the memory, then the pointers.
    const std::size_t first_part = parts.size();
    std::size_t bytes = 0;
    const auto place = [&](const auto* from, std::size_t size) {
      parts.push_back({reinterpret_cast<const char*>(from), reinterpret_cast<char*>(bytes), size * sizeof(*from)});
      bytes += (size * sizeof(*from) + 255) / 256 * 256;
    };
    const std::size_t begin = segments.offset[c], n = cloud->size, block_begin = closest.blocks.offset[c];
    place(clouds.points.data() + begin, n);
    place(normals.data() + begin, n);
    place(features.values.data() + features.offset[c], n * cloud->feature_dimension);
    place(features.valid.data() + begin, n);
    place(closest.table.data() + closest.table_offset[c], closest.table_offset[c + 1] - closest.table_offset[c]);
    place(closest.cell_start.data() + block_begin * (ClosestGridView::kBlockCells + 1),
          std::size_t(cloud->block_count) * (ClosestGridView::kBlockCells + 1));
    place(closest.candidates.data() + closest.candidate_offset[c], cloud->candidate_count);
    place(closest.block.data() + block_begin, cloud->block_count);
    const std::size_t norms = bytes;
    bytes += (n * sizeof(float2) + 255) / 256 * 256;
    const std::size_t tf32 = bytes;
    const std::uint32_t width = filter_width(cloud->feature_dimension);
    bytes += (n * width * sizeof(std::uint32_t) + 255) / 256 * 256;
    const std::size_t padded = bytes;
    bytes += (n * width * sizeof(float) + 255) / 256 * 256;
    const std::size_t copied = bytes;
    const ScoringLayout layout = scoring_layout(*cloud, closest.block_range[c]);
    // Filled: tables begin empty, and what lies between the arrays is copied along with them.
    cloud->data = exec.filled<char>(copied + layout.bytes, 0);
    for (std::size_t k = first_part; k < parts.size(); ++k) parts[k].to = cloud->data.data() + reinterpret_cast<std::size_t>(parts[k].to);
    const Part* part = parts.data() + first_part;
    CloudView& view = cloud->view_on_device;
    view.points = reinterpret_cast<const Vec3*>(part[0].to);
    view.normals = reinterpret_cast<const Vec3*>(part[1].to);
    view.features = reinterpret_cast<const float*>(part[2].to);
    view.has_feature = reinterpret_cast<const std::uint8_t*>(part[3].to);
    view.size = cloud->size;
    view.feature_dimension = cloud->feature_dimension;
    view.radius = cloud->radius;
    view.closest = {1.0f / closest.geometry[c].cell_size,
                    {reinterpret_cast<const CellEntry*>(part[4].to), closest.table_offset[c + 1] - closest.table_offset[c]},
                    {reinterpret_cast<const std::uint32_t*>(part[5].to), std::size_t(cloud->block_count) * (ClosestGridView::kBlockCells + 1)},
                    {reinterpret_cast<const std::uint32_t*>(part[6].to), cloud->candidate_count}};
    view.executor_data = cloud.get();
    cloud->feature_norm = reinterpret_cast<float2*>(cloud->data.data() + norms);
    if (width > 0) {
      cloud->feature_tf32 = reinterpret_cast<std::uint32_t*>(cloud->data.data() + tf32);
      cloud->feature_padded = reinterpret_cast<float*>(cloud->data.data() + padded);
    }
    norm_slots.push_back({view.features, view.has_feature, view.size, view.feature_dimension, width, cloud->feature_norm, cloud->feature_tf32,
                          cloud->feature_padded});
    cloud->blocks = reinterpret_cast<const Cell*>(part[7].to);
    place_scoring_data(layout, closest.geometry[c], cloud->data.data() + copied, *cloud);
    out.push_back(std::move(cloud));
  }
  const auto parts_on_device = exec.upload(parts);
  const auto missing = exec.filled<Missing>(count, 0);
  copy_parts<<<dim3(16, static_cast<unsigned>(parts.size())), 256, 0, exec.stream()>>>(parts_on_device.data());
  check_launch("copy_parts");
  count_missing<<<dim3(8, static_cast<unsigned>(count)), 256, 0, exec.stream()>>>(segments.on_device.data(), normals.data(),
                                                                                  features.valid.data(), missing.data());
  check_launch("count_missing");
  const auto norm_slots_on_device = exec.upload(norm_slots);
  measure_features<<<dim3(16, static_cast<unsigned>(count)), 256, 0, exec.stream()>>>(norm_slots_on_device.data(), missing.data());
  check_launch("measure_features");
  fill_scoring_data(exec, out, closest.geometry);
  const Missing* counted = exec.download(missing.data(), count);
  exec.synchronize();
  for (std::size_t c = 0; c < count; ++c) {
    out[c]->statistics.points_without_normal = counted[c].normals;
    out[c]->statistics.points_without_feature = counted[c].features;
    if (counted[c].extreme_features > 0) out[c]->feature_tf32 = nullptr;
  }
  return out;
}

}  // namespace gpureg::cuda
