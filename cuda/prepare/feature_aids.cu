// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/prepare/feature_aids.hpp"

#include <cuda_fp16.h>

#include <limits>

#include "algorithm/fpfh.hpp"
#include "cuda/device/launch.cuh"
#include "cuda/device/warp.cuh"

namespace gpureg::cuda {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// Scale of turned copies: the parts of FPFH are at most 100.
constexpr float kTurnedScale = 8.0f;
/// Longer features leave the range in which the error bounds hold.
constexpr float kMaxSquare = 1e30f;

struct FeatureSlot : FeaturesToMeasure {
  std::uint32_t half_width, padded_width;
  std::uint32_t* largest;  // bits of the greatest magnitude of all values
  std::uint32_t* first;    // table of `places`: lowest index of a row with this hash
  std::uint32_t places;
};

__device__ float component(const FeatureSlot& s, const float* row, std::uint32_t d) {
  return d < s.dimension ? row[d] - (s.aids.copy == HalfCopy::turned ? center_of_fpfh(d) : 0.0f)
                         : 0.0f;
}

/// Slot of a row in the table of hashes (FNV-1a by words, with a final mix per word).
__device__ std::uint32_t hash_slot(const FeatureSlot& s, const float* row) {
  constexpr std::uint32_t kBasis = 2166136261u, kPrime = 16777619u;
  std::uint32_t hash = kBasis;
  for (std::uint32_t d = 0; d < s.dimension; ++d) {
    hash = (hash ^ __float_as_uint(row[d])) * kPrime;
    hash ^= hash >> 15;
  }
  return hash % s.places;
}

__global__ void find_largest(const FeatureSlot* slots) {
  const FeatureSlot s = slots[blockIdx.y];
  if (s.aids.copy == HalfCopy::turned) return;  // at most 100
  std::uint32_t largest = 0;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < s.size;
       i += gridDim.x * blockDim.x)
    for (std::uint32_t d = 0; s.valid[i] && d < s.dimension; ++d)
      largest = max(largest, __float_as_uint(fabsf(component(
                                 s, s.features + static_cast<std::size_t>(i) * s.dimension, d))));
  largest = warp_max(largest);
  if (threadIdx.x % 32 == 0) atomicMax(s.largest, largest);
}

/// The power of two that scales the largest value to between 512 and 1024, within the range of
/// binary16. Lengths stay within the range of float32.
__device__ float scale_to_half(std::uint32_t largest) {
  constexpr int kBias = 127;           // of the exponent of float32
  constexpr int kLargestExponent = 9;  // of values from 512 to 1024
  constexpr int kMostExponent = 40;    // squares of the scale stay in range
  const int exponent = kBias + kLargestExponent - static_cast<int>(largest >> 23);
  return __uint_as_float(
      static_cast<std::uint32_t>(kBias + max(-kMostExponent, min(kMostExponent, exponent))) << 23);
}

/// Search data beside the features: copies for the tensor cores, and error bounds of their
/// products.
__global__ void measure_features(const FeatureSlot* slots) {
  const FeatureSlot s = slots[blockIdx.y];
  const float scale = s.aids.copy == HalfCopy::turned ? kTurnedScale : scale_to_half(*s.largest);
  std::uint32_t extreme = 0;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < s.size;
       i += gridDim.x * blockDim.x) {
    const float* row = s.features + static_cast<std::size_t>(i) * s.dimension;
    const bool valid = s.valid[i];
    float square = 0.0f, rest = 0.0f, lost = 0.0f;
    std::uint16_t* const copy = s.aids.half + static_cast<std::size_t>(i) * s.half_width;
    const auto value = [&](std::uint32_t d) { return valid ? component(s, row, d) * scale : 0.0f; };
    // Writes the first 11 bits and returns the remainder.
    const auto put_half = [&](std::uint32_t d, float v) {
      const __half h = __float2half_rn(v);
      copy[d] = __half_as_ushort(h);
      return v - __half2float(h);
    };
    const auto leave_out = [&](float v) {
      rest = fmaf(v, v, rest);
      lost = fmaf(v, v, lost);
    };
    const auto put = [&](std::uint32_t d, float v) {
      const float difference = put_half(d, v);
      rest = fmaf(v, v, rest);
      lost = fmaf(difference, difference, lost);
    };
    if (s.aids.copy == HalfCopy::turned) {
      const auto put_axis = [&](float v) {
        put_half(kAxisPlace + 2, v);
        put_half(kAxisPlace + 1, put_half(kAxisPlace, v));
        square = v * v;
      };
      turn_fpfh([&](int d) { return value(static_cast<std::uint32_t>(d)); },
                [&](int k, float v) { put(static_cast<std::uint32_t>(k), v); }, put_axis,
                leave_out);
    } else {
      for (std::uint32_t d = 0; d < s.half_width; ++d) put(d, value(d));
    }
    square = square + rest;
    for (std::uint32_t d = 0; d < s.padded_width; ++d)
      s.rows[static_cast<std::size_t>(i) * s.padded_width + d] = d < s.dimension ? row[d] : 0.0f;
    const float error = product_error(square, rest, lost);
    s.aids.error[i] = error;
    s.aids.square[i] =
        valid ? make_float2(square - error, square + error) : make_float2(kInfinity, kInfinity);
    if (valid) atomicMin(s.first + hash_slot(s, row), i);
    extreme += valid && !(square < kMaxSquare * (scale * scale));
  }
  if (blockIdx.x == 0 && threadIdx.x == 0) *s.aids.scale = scale;
  if (extreme > 0) atomicAdd(s.extreme, extreme);
}

/// Only the first of equal features is ever found; this removes the others from the search.
/// Noise-free walls have thousands of equal features.
__global__ void find_repeated_features(const FeatureSlot* slots) {
  const FeatureSlot s = slots[blockIdx.y];
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < s.size;
       i += gridDim.x * blockDim.x) {
    const float* row = s.features + static_cast<std::size_t>(i) * s.dimension;
    bool repeats = false;
    if (s.valid[i]) {
      const std::uint32_t first = s.first[hash_slot(s, row)];
      repeats = first < i;
      const float* other = s.features + static_cast<std::size_t>(first) * s.dimension;
      for (std::uint32_t d = 0; repeats && d < s.dimension; ++d) repeats = row[d] == other[d];
    }
    if (repeats) s.aids.square[i] = make_float2(kInfinity, kInfinity);
  }
}

}  // namespace

std::size_t feature_aids_bytes(int k, std::size_t size, std::uint32_t dimension, HalfCopy copy) {
  const std::size_t width = half_width(dimension, copy);
  if (width == 0 || dimension == 0) return 0;
  const std::size_t bytes[FeatureAidsPlaces::kArrays] = {size * width * sizeof(std::uint16_t),
                                                         size * sizeof(float2),
                                                         size * sizeof(float), sizeof(float)};
  return bytes[k];
}

FeatureAids feature_aids_at(char* memory, const FeatureAidsPlaces& places, HalfCopy copy) {
  const auto at = [&](int k) { return memory + places.begin[k]; };
  return {reinterpret_cast<std::uint16_t*>(at(0)), reinterpret_cast<float2*>(at(1)),
          reinterpret_cast<float*>(at(2)), reinterpret_cast<float*>(at(3)), copy};
}

void fill_feature_aids(Exec& exec, const std::vector<FeaturesToMeasure>& clouds) {
  if (clouds.empty()) return;
  std::vector<FeatureSlot> slots;
  std::size_t places = 0;
  for (const FeaturesToMeasure& c : clouds) {
    slots.push_back({c, half_width(c.dimension, c.aids.copy), padded_width(c.dimension), nullptr,
                     nullptr, 4 * c.size + 1});
    places += slots.back().places;
  }
  const auto first = exec.filled<std::uint32_t>(places, 0xff);
  const auto largest = exec.filled<std::uint32_t>(slots.size(), 0);
  std::uint32_t* at = first.data();
  for (std::size_t k = 0; k < slots.size(); ++k) {
    slots[k].first = at;
    at += slots[k].places;
    slots[k].largest = largest.data() + k;
  }
  const auto on_device = exec.upload(slots);
  const dim3 grid(16, static_cast<unsigned>(slots.size()));
  launch(exec, "find_largest", find_largest, {grid, 256}, on_device.data());
  launch(exec, "measure_features", measure_features, {grid, 256}, on_device.data());
  launch(exec, "find_repeated_features", find_repeated_features, {grid, 256}, on_device.data());
}

}  // namespace gpureg::cuda
