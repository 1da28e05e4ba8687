// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/prepare/average_voxels.hpp"

#include <algorithm>

#include "algorithm/normal.hpp"
#include "cuda/device/launch.cuh"
#include "cuda/device/warp.cuh"

namespace gpureg::cuda {
namespace {

/// Points of a voxel from which on a thread block adds them up instead of a thread: a thread waits
/// for every point in turn.
constexpr std::uint32_t kCrowded = 512;
constexpr int kCrowdedThreads = 256;

/// Voxels left to average_crowded().
struct Crowded {
  std::uint32_t* count;
  uint2* voxel;  // (cloud, voxel)
};

/// Sorted positions of the points of a voxel.
struct VoxelRange {
  std::uint32_t begin, end;
};
__device__ VoxelRange range_of_voxel(const Average& a, std::uint32_t c, std::uint32_t v) {
  const std::uint32_t first = a.offset[c];
  return {a.start[first + v], first + v + 1 < a.offset[c + 1]
                                  ? a.start[first + v + 1]
                                  : a.raw_offset[c] + a.extents[c].finite};
}

/// One thread per voxel adds up its points in input order.
__global__ void average(Average a, Crowded crowded) {
  const std::uint32_t c = blockIdx.y, first = a.offset[c], size = a.offset[c + 1] - first;
  const RawSlot slot = a.slots[c];
  std::uint32_t largest = 0;
  for (std::uint32_t v = blockIdx.x * blockDim.x + threadIdx.x; v < size;
       v += gridDim.x * blockDim.x) {
    const auto [begin, end] = range_of_voxel(a, c, v);
    if (end - begin >= kCrowded) {
      crowded.voxel[atomicAdd(crowded.count, 1u)] = make_uint2(c, v);
      continue;
    }
    const float inverse_count = 1.0f / static_cast<float>(end - begin);
    Vec3 sum{0, 0, 0}, guide{0, 0, 0};
    for (std::uint32_t k = begin; k < end; ++k) {
      const std::uint32_t i = a.item[k];
      sum = sum + (slot.points[i] - slot.origin);
      if (slot.normals) guide = guide + normalized_or_zero(slot.normals[i]);
    }
    const Vec3 p =
        end - begin == 1 ? slot.points[a.item[begin]] - slot.origin : sum * inverse_count;
    a.points[first + v] = p;
    if (a.guides) a.guides[first + v] = guide;
    largest = max(largest, __float_as_uint(squared_norm(p)));
    float* out = a.features + a.feature_offset[c] + static_cast<std::size_t>(v) * slot.dimension;
    for (std::uint32_t d = 0; d < slot.dimension; ++d) {
      float mean = 0.0f;
      for (std::uint32_t k = begin; k < end; ++k)
        mean += slot.features[static_cast<std::size_t>(a.item[k]) * slot.dimension + d];
      out[d] = mean * inverse_count;
    }
  }
  // Threads without a voxel take part in the reduction over the warp.
  largest = warp_max(largest);
  if (threadIdx.x % 32 == 0 && largest > 0) atomicMax(a.largest_squared_norm + c, largest);
}

/// A thread block per crowded voxel. All threads fetch points; one thread per coordinate adds them
/// up in input order, which gives the bits of average().
__global__ void __launch_bounds__(kCrowdedThreads) average_crowded(Average a, Crowded crowded) {
  __shared__ float rows[kCrowdedThreads][7];  // point, guide; seven words avoid bank conflicts
  __shared__ std::uint32_t items[kCrowdedThreads];
  __shared__ float sums[6];
  const std::uint32_t count = *crowded.count;
  for (std::uint32_t k = blockIdx.x; k < count; k += gridDim.x) {
    const std::uint32_t c = crowded.voxel[k].x, v = crowded.voxel[k].y, out_place = a.offset[c] + v;
    const RawSlot slot = a.slots[c];
    const auto [begin, end] = range_of_voxel(a, c, v);
    const float inverse_count = 1.0f / static_cast<float>(end - begin);
    const int coordinates = slot.normals ? 6 : 3;
    float sum = 0.0f;
    for (std::uint32_t base = begin; base < end; base += kCrowdedThreads) {
      const int size = static_cast<int>(min(end - base, std::uint32_t(kCrowdedThreads)));
      if (static_cast<int>(threadIdx.x) < size) {
        const std::uint32_t i = a.item[base + threadIdx.x];
        const Vec3 p = slot.points[i] - slot.origin;
        float* row = rows[threadIdx.x];
        row[0] = p.x;
        row[1] = p.y;
        row[2] = p.z;
        if (slot.normals) {
          const Vec3 n = normalized_or_zero(slot.normals[i]);
          row[3] = n.x;
          row[4] = n.y;
          row[5] = n.z;
        }
      }
      __syncthreads();
      if (static_cast<int>(threadIdx.x) < coordinates) {
#pragma unroll 16
        for (int j = 0; j < size; ++j) sum = sum + rows[j][threadIdx.x];
      }
      __syncthreads();
    }
    if (threadIdx.x < 6) sums[threadIdx.x] = sum;
    __syncthreads();
    if (threadIdx.x == 0) {
      const Vec3 p = Vec3{sums[0], sums[1], sums[2]} * inverse_count;
      a.points[out_place] = p;
      if (a.guides) a.guides[out_place] = {sums[3], sums[4], sums[5]};
      atomicMax(a.largest_squared_norm + c, __float_as_uint(squared_norm(p)));
    }
    float* out = a.features + a.feature_offset[c] + static_cast<std::size_t>(v) * slot.dimension;
    for (std::uint32_t first = 0; first < slot.dimension; first += kCrowdedThreads) {
      const std::uint32_t d = first + threadIdx.x;
      float mean = 0.0f;
      for (std::uint32_t base = begin; base < end; base += kCrowdedThreads) {
        const int size = static_cast<int>(min(end - base, std::uint32_t(kCrowdedThreads)));
        __syncthreads();
        if (static_cast<int>(threadIdx.x) < size) items[threadIdx.x] = a.item[base + threadIdx.x];
        __syncthreads();
        if (d < slot.dimension) {
#pragma unroll 8
          for (int j = 0; j < size; ++j)
            mean += slot.features[static_cast<std::size_t>(items[j]) * slot.dimension + d];
        }
      }
      if (d < slot.dimension) out[d] = mean * inverse_count;
    }
    __syncthreads();
  }
}

}  // namespace

void average_voxels(Exec& exec, const Average& voxels, std::size_t clouds, std::uint32_t largest,
                    std::size_t raw_points) {
  constexpr unsigned kThreads = 128;
  // A crowded voxel takes as many points as no other voxel has.
  const std::size_t most_crowded = raw_points / kCrowded;
  const auto count = exec.filled<std::uint32_t>(1, 0);
  const auto list = exec.buffer<uint2>(most_crowded);
  const Crowded crowded{count.data(), list.data()};
  const dim3 grid(std::max(1u, blocks_for(largest, kThreads)), static_cast<unsigned>(clouds));
  launch(exec, "average", average, {grid, kThreads}, voxels, crowded);
  if (most_crowded == 0) return;
  const auto blocks = std::min<std::size_t>(most_crowded, std::size_t(exec.multiprocessors()) * 4);
  launch(exec, "average_crowded", average_crowded, {static_cast<unsigned>(blocks), kCrowdedThreads},
         voxels, crowded);
}

}  // namespace gpureg::cuda
