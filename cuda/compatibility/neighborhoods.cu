// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/compatibility/neighborhoods.hpp"

#include "cuda/common/stages.hpp"
#include "cuda/compatibility/match_set.cuh"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 128;
constexpr int kColumns = 2;           // matches of a thread
constexpr std::uint32_t kSeeds = 64;  // seeds of a thread block

/// Thread blocks (x: matches, y: seeds, z: pair): each warp keeps its matches in registers and
/// iterates over the seeds.
__global__ void __launch_bounds__(kThreads)
    find_compatible(MatchSetView matches, const std::uint32_t* room,
                    const std::uint32_t* match_count, const std::uint32_t* seed,
                    const std::uint32_t* seed_count, std::uint32_t most_seeds,
                    CompatibilityTest test, std::uint32_t words, std::uint32_t* bits) {
  __shared__ PackedMatch tile[kSeeds];
  const std::uint32_t p = blockIdx.z, n = match_count[p], begin = room[p],
                      first_seed = blockIdx.y * kSeeds;
  const std::uint32_t first = blockIdx.x * kThreads * kColumns;
  if (first_seed >= seed_count[p] || first >= n) return;
  const std::uint32_t size = min(kSeeds, seed_count[p] - first_seed), lane = threadIdx.x % 32;
  for (std::uint32_t k = threadIdx.x; k < size; k += kThreads)
    tile[k] = packed(match_at(matches, begin + seed[p * most_seeds + first_seed + k]));
  OrientedMatch own[kColumns];
  std::uint32_t at[kColumns];
#pragma unroll
  for (int c = 0; c < kColumns; ++c) {
    at[c] = first + static_cast<std::uint32_t>(c) * kThreads + threadIdx.x;
    own[c] = match_at(matches, begin + min(at[c], n - 1));
  }
  __syncthreads();
  std::uint32_t* out = bits + (static_cast<std::size_t>(p) * most_seeds + first_seed) * words;
  for (std::uint32_t k = 0; k < size; ++k) {
    const OrientedMatch other = tile[k].unpacked();
#pragma unroll
    for (int c = 0; c < kColumns; ++c) {
      const unsigned word = __ballot_sync(~0u, at[c] < n && compatible(own[c], other, test));
      if (lane == 0 && at[c] < n) out[static_cast<std::size_t>(k) * words + at[c] / 32] = word;
    }
  }
}

}  // namespace

Neighborhoods find_neighborhoods(Exec& exec, const MatchSets& matches, const Seeds& seeds,
                                 const CompatibilitySettings& options) {
  const std::size_t pairs = matches.room.entries();
  const std::uint32_t largest = matches.room.largest;
  Neighborhoods out;
  out.words = (largest + 31) / 32;
  out.bits = exec.buffer<std::uint32_t>(pairs * seeds.most * out.words);
  if (largest == 0) return out;
  launch(exec, "find_compatible", find_compatible,
         {{blocks_for(largest, kThreads * kColumns),
           blocks_for(std::min(seeds.most, largest), kSeeds), static_cast<unsigned>(pairs)},
          kThreads},
         matches.view(), matches.room.on_device.data(), matches.count.data(), seeds.match.data(),
         seeds.count.data(), seeds.most, test_of(options), out.words, out.bits.data());
  return out;
}

}  // namespace gpureg::cuda
