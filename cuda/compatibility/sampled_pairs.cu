// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/compatibility/sampled_pairs.hpp"

#include <algorithm>

#include "algorithm/evidence.hpp"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 256;

std::vector<SampledPair> with_all_points(Span<const PairView> pairs) {
  std::vector<SampledPair> out;
  out.reserve(pairs.size);
  for (const PairView& pair : pairs) out.push_back({search_pair(pair), pair.source, pair.target});
  return out;
}

std::uint32_t sampled_size(const CloudView& cloud, std::uint32_t most) {
  const std::uint32_t stride = sample_stride(cloud.size, most);
  return cloud.size / stride + (cloud.size % stride > 0 ? 1 : 0);
}

/// x: sampled points, y: pair, z: source or target. The arrays of the samples are those of rows and
/// weight.
__global__ void __launch_bounds__(kThreads)
    copy_sample(const SampledPair* pairs, std::uint32_t most, Vec3* rows, std::uint32_t* weight) {
  const SampledPair& p = pairs[blockIdx.y];
  const CloudView &from = blockIdx.z == 0 ? p.pair.source : p.pair.target,
                  &to = blockIdx.z == 0 ? p.source : p.target;
  const std::uint32_t k = blockIdx.x * kThreads + threadIdx.x;
  if (k >= to.size) return;
  const std::size_t i = static_cast<std::size_t>(k) * sample_stride(from.size, most);
  rows[to.points - rows + k] = from.points[i];
  rows[to.normals - rows + k] = from.normals[i];
  weight[to.normal_weight - weight + k] = from.normal_weight[i];
}

}  // namespace

SampledPairs whole_pairs(Exec& exec, Span<const PairView> pairs) {
  SampledPairs out;
  out.pairs = exec.upload(with_all_points(pairs));
  return out;
}

SampledPairs sample_pairs(Exec& exec, Span<const PairView> pairs, std::uint32_t most, bool both) {
  std::vector<SampledPair> sampled = with_all_points(pairs);
  std::size_t total = 0;
  std::uint32_t largest = 0;
  const auto reserve = [&](CloudView& cloud) {
    cloud.size = sampled_size(cloud, most);
    total += cloud.size;
    largest = std::max(largest, cloud.size);
  };
  for (SampledPair& pair : sampled) {
    reserve(pair.source);
    if (both) reserve(pair.target);
  }
  SampledPairs out;
  out.rows = exec.buffer<Vec3>(2 * total);
  out.weight = exec.buffer<std::uint32_t>(total);
  std::size_t at = 0;
  const auto place = [&](CloudView& cloud) {
    cloud.points = out.rows.data() + at;
    cloud.normals = out.rows.data() + total + at;
    cloud.normal_weight = out.weight.data() + at;
    at += cloud.size;
  };
  for (SampledPair& pair : sampled) {
    place(pair.source);
    if (both) place(pair.target);
  }
  out.pairs = exec.upload(sampled);
  if (largest == 0) return out;
  launch(exec, "copy_sample", copy_sample,
         {{blocks_for(largest, kThreads), static_cast<unsigned>(pairs.size), both ? 2u : 1u},
          kThreads},
         out.pairs.data(), most, out.rows.data(), out.weight.data());
  return out;
}

}  // namespace gpureg::cuda
