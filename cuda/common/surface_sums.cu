// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "cuda/common/surface_grids.hpp"
#include "cuda/device/block_sum.cuh"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

constexpr unsigned kThreads = 128;
/// Points of a thread: fewer would pay more for the sums over the thread block.
constexpr std::size_t kPointsPerThread = 4;
/// Largest extent of a grid along y.
constexpr std::size_t kMaxPairsPerLaunch = 32768;

struct AddUp {
  const SurfaceArrays* surfaces;
  const SurfaceGridView* grids;
  std::uint32_t first_target;
  const SurfacePairInput* pairs;
  SurfaceTerms terms;
  SurfaceSums* sums;
};

/// Thread blocks (x) of a pair (y).
__global__ void __launch_bounds__(kThreads) add_up(AddUp batch) {
  __shared__ std::int64_t scratch[kThreads / 32 * kSurfaceSums];
  const SurfacePairInput pair = batch.pairs[blockIdx.y];
  const SurfaceArrays source = batch.surfaces[pair.source];
  const SurfaceGridView target = batch.grids[pair.target - batch.first_target];
  const std::uint64_t step = surface_step(source.size, batch.terms.max_points);
  SurfaceSums sum{};
  SurfaceCorrespondence c;
  for (std::uint64_t i = (blockIdx.x * kThreads + threadIdx.x) * step; i < source.size;
       i += gridDim.x * kThreads * step) {
    if (!surface_correspondence(source, target, pair.target_from_source, batch.terms,
                                static_cast<std::uint32_t>(i), c))
      continue;
    add_icp_term(c.arm, c.normal, c.residual, c.weight, sum.equations);
    sum.squared += to_icp_fixed(c.residual * c.residual);
    ++sum.count;
  }
  if (!__syncthreads_or(sum.count > 0)) return;
  std::int64_t v[kSurfaceSums];
#pragma unroll
  for (int k = 0; k < 27; ++k) v[k] = sum.equations.v[k];
  v[27] = sum.squared;
  v[28] = sum.count;
  block_sum(v, scratch);
  if (threadIdx.x != 0) return;
  auto* out = reinterpret_cast<unsigned long long*>(batch.sums + blockIdx.y);
#pragma unroll
  for (int k = 0; k < kSurfaceSums; ++k) atomicAdd(out + k, static_cast<unsigned long long>(v[k]));
}

}  // namespace

void add_up_surfaces(Exec& exec, const SurfaceArrays* surfaces, const SurfaceGrids& grids,
                     std::uint32_t first_target, const SurfacePairInput* pairs, std::size_t count,
                     std::uint32_t most_points, const SurfaceTerms& terms, SurfaceSums* sums) {
  const std::size_t points = most_points / surface_step(most_points, terms.max_points) + 1;
  for (std::size_t begin = 0; begin < count; begin += kMaxPairsPerLaunch) {
    const std::size_t size = std::min(kMaxPairsPerLaunch, count - begin);
    const AddUp batch{surfaces, grids.views.data(), first_target, pairs + begin,
                      terms,    sums + begin};
    launch(
        exec, "add_up", add_up,
        {{blocks_for(points, kThreads * kPointsPerThread), static_cast<unsigned>(size)}, kThreads},
        batch);
  }
}

}  // namespace gpureg::cuda
