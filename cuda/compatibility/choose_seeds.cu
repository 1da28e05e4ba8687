// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "cuda/common/stages.hpp"
#include "cuda/compatibility/match_set.cuh"
#include "cuda/device/device_algorithms.hpp"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 128, kRows = 4;                // matches of a thread
constexpr std::uint32_t kBlockRows = kThreads * kRows;  // matches of a thread block
// matches in shared memory at a time
constexpr std::uint32_t kTile = kThreads;
// matches of the sample that a thread block compares, at most
constexpr std::uint32_t kBlockColumns = 4 * kTile;
// matches that a lane of find_slopes() holds
constexpr std::uint32_t kHeld = 8;
constexpr int kDegreeBits = 12;  // 0 to 2^11
constexpr std::uint32_t kMaxDegree = (1u << kDegreeBits) - 1;
constexpr int kStrengthBits = 24;  // 0 to 2^23, see seed_strength()
constexpr std::uint32_t kMaxStrength = (1u << kStrengthBits) - 2;
constexpr std::uint32_t kPadding = (2u << kStrengthBits) - 1;  // greater than the key of any match
static_assert(kDegreeSample <= kMaxDegree, "keys hold every degree");
static_assert(std::uint64_t(kDegreeSample) << 17 >> kStrengthShift <= kMaxStrength,
              "keys hold every strength, see seed_strength()");

struct SeedBatch {
  MatchSetView matches;
  const std::uint32_t* room;
  const std::uint32_t* count;
  std::uint32_t columns;  ///< of a thread block
  CompatibilityTest test;
  float squared_separation;
  std::uint32_t* degree;
  std::uint8_t* slope;
};

/// Degrees, see kDegreeSample. Thread blocks: x matches, y part of the sample, z pair.
__global__ void __launch_bounds__(kThreads) count_compatible(SeedBatch b) {
  __shared__ PackedMatch tile[kTile];
  const std::uint32_t p = blockIdx.z, n = b.count[p], room = b.room[p],
                      row = blockIdx.x * kBlockRows, column = blockIdx.y * b.columns;
  const std::uint32_t last = min(min(n, kDegreeSample), column + b.columns);
  if (row >= n || column >= last) return;
  OrientedMatch own[kRows];
  std::uint32_t count[kRows];
#pragma unroll
  for (int r = 0; r < kRows; ++r) {
    const std::uint32_t i = row + static_cast<std::uint32_t>(r) * kThreads + threadIdx.x;
    own[r] = match_at(b.matches, room + min(i, n - 1));
    count[r] = 0;
  }
  for (std::uint32_t base = column; base < last; base += kTile) {
    const std::uint32_t size = min(kTile, last - base);
    __syncthreads();
    if (threadIdx.x < size)
      tile[threadIdx.x] = packed(match_at(b.matches, room + base + threadIdx.x));
    __syncthreads();
    for (std::uint32_t k = 0; k < size; ++k) {
      const OrientedMatch other = tile[k].unpacked();
#pragma unroll
      for (int r = 0; r < kRows; ++r) count[r] += compatible(other, own[r], b.test) ? 1u : 0u;
    }
  }
#pragma unroll
  for (int r = 0; r < kRows; ++r) {
    const std::uint32_t i = row + static_cast<std::uint32_t>(r) * kThreads + threadIdx.x;
    if (i < n && count[r] > 0) atomicAdd(b.degree + room + i, count[r]);
  }
}

/// Keys that sort by pair, then by descending degree.
__global__ void write_degree_keys(SeedBatch b, std::uint64_t* key, std::uint32_t* match) {
  const std::uint32_t p = blockIdx.y, n = b.count[p], room = b.room[p],
                      i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= b.room[p + 1] - room) return;
  const std::uint32_t before = i < n ? kMaxDegree - b.degree[room + i] : kMaxDegree;
  key[room + i] = static_cast<std::uint64_t>(p) << kDegreeBits | before;
  match[room + i] = i;
}

/// Source points and degrees in that order.
__global__ void rank_points(SeedBatch b, const std::uint32_t* match, float4* ranked) {
  const std::uint32_t p = blockIdx.y, room = b.room[p], k = blockIdx.x * blockDim.x + threadIdx.x;
  if (k >= b.count[p]) return;
  const std::uint32_t at = room + match[room + k];
  ranked[room + k] = make_float4(b.matches.px[at], b.matches.py[at], b.matches.pz[at],
                                 __uint_as_float(b.degree[at]));
}

/// Marks the matches with a neighbour that has more compatible matches. Matches of high degree are
/// compared first, as most matches have one of them near. A warp takes 32 matches of similar
/// degree: each lane holds other matches, and all lanes compare them with one of the 32 at a time.
/// Several warps (z) may share the others.
__global__ void __launch_bounds__(kThreads)
    find_slopes(SeedBatch b, const float4* ranked, const std::uint32_t* match) {
  const std::uint32_t p = blockIdx.y, n = b.count[p], room = b.room[p], lane = threadIdx.x % 32;
  const std::uint32_t k = blockIdx.x * blockDim.x + threadIdx.x, first = k - lane;
  if (first >= n) return;
  const float4 own = ranked[room + min(k, n - 1)];
  unsigned open = __ballot_sync(~0u, k < n);
  // No degree is greater behind the matches of the warp.
  const std::uint32_t step = 32 * kHeld;
  for (std::uint32_t base = blockIdx.z * step; open != 0 && base < min(n, first + 32);
       base += gridDim.z * step) {
    float4 other[kHeld];
#pragma unroll
    for (std::uint32_t h = 0; h < kHeld; ++h)
      other[h] = ranked[room + min(base + h * 32 + lane, n - 1)];
    for (unsigned left = open; left != 0; left &= left - 1) {
      const int l = __ffs(static_cast<int>(left)) - 1;
      const Vec3 point{__shfl_sync(~0u, own.x, l), __shfl_sync(~0u, own.y, l),
                       __shfl_sync(~0u, own.z, l)};
      const std::uint32_t degree = __float_as_uint(__shfl_sync(~0u, own.w, l));
      bool greater = false;
#pragma unroll
      for (std::uint32_t h = 0; h < kHeld; ++h)
        greater |=
            (__float_as_uint(other[h].w) > degree) &
            (squared_norm(Vec3{other[h].x, other[h].y, other[h].z} - point) < b.squared_separation);
      if (__any_sync(~0u, greater)) open &= ~(1u << l);
    }
  }
  if (k < n && (open >> lane & 1) == 0) b.slope[room + match[room + k]] = 1;
}

/// Keys that sort by pair, then as seed_key() does, the best first; equal keys keep the order of
/// the matches.
__global__ void write_keys(SeedBatch b, std::uint64_t* key, std::uint32_t* match) {
  const std::uint32_t p = blockIdx.y, n = b.count[p], room = b.room[p],
                      i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= b.room[p + 1] - room) return;
  std::uint32_t order = kPadding;
  if (i < n) {
    const std::uint32_t strength = seed_strength(
        b.degree[room + i], b.matches.source_weight[room + i] + b.matches.target_weight[room + i]);
    order = (b.slope[room + i] ? 1u << kStrengthBits : 0u) + (kMaxStrength - strength);
  }
  key[room + i] = static_cast<std::uint64_t>(p) << (kStrengthBits + 1) | order;
  match[room + i] = i;
}

__global__ void take_seeds(SeedBatch b, const std::uint32_t* ranked, std::uint32_t most,
                           std::uint32_t* match, std::uint32_t* count) {
  const std::uint32_t p = blockIdx.y, k = blockIdx.x * blockDim.x + threadIdx.x,
                      size = min(most, b.count[p]);
  if (k < size) match[p * most + k] = ranked[b.room[p] + k];
  if (k == 0) count[p] = size;
}

}  // namespace

Seeds choose_seeds(Exec& exec, const MatchSets& matches, const RegistrationSettings& options) {
  const std::size_t pairs = matches.room.entries();
  const unsigned pair_count = static_cast<unsigned>(pairs);
  Seeds out;
  out.most = options.compatibility.seeds;
  out.match = exec.buffer<std::uint32_t>(pairs * out.most);
  out.count = exec.filled<std::uint32_t>(pairs, 0);
  const std::uint32_t total = matches.room.total(), largest = matches.room.largest;
  if (total == 0) return out;
  const auto degree = exec.filled<std::uint32_t>(total, 0);
  const auto slope = exec.filled<std::uint8_t>(total, 0);
  SeedBatch batch{};
  batch.matches = matches.view();
  batch.room = matches.room.on_device.data();
  batch.count = matches.count.data();
  batch.test = test_of(options.compatibility);
  batch.squared_separation =
      options.compatibility.seed_separation * options.compatibility.seed_separation;
  batch.degree = degree.data();
  batch.slope = slope.data();
  const std::uint32_t row_blocks = blocks_for(largest, kBlockRows),
                      columns = std::min(largest, kDegreeSample);
  batch.columns = items_per_block(exec, row_blocks * pairs, columns, kBlockColumns, kTile);
  launch(exec, "count_compatible", count_compatible,
         {{row_blocks, blocks_for(columns, batch.columns), pair_count}, kThreads}, batch);
  auto key = exec.buffer<std::uint64_t>(total);
  auto match = exec.buffer<std::uint32_t>(total);
  const auto ranked = exec.buffer<float4>(total);
  const dim3 grid(blocks_for(largest, 256), pair_count);
  launch(exec, "write_degree_keys", write_degree_keys, {grid, 256}, batch, key.data(),
         match.data());
  sort_segments(exec, key, match, matches.room, kDegreeBits);
  launch(exec, "rank_points", rank_points, {grid, 256}, batch, match.data(), ranked.data());
  // Its warps work by themselves; where they are few, four take the place of one.
  const std::uint32_t threads = items_per_block(exec, pairs, largest, kThreads, 32);
  launch(exec, "find_slopes", find_slopes,
         {{blocks_for(largest, threads), pair_count, threads == 32 ? 4u : 1u}, threads}, batch,
         ranked.data(), match.data());
  launch(exec, "write_keys", write_keys, {grid, 256}, batch, key.data(), match.data());
  sort_segments(exec, key, match, matches.room, kStrengthBits + 1);
  launch(exec, "take_seeds", take_seeds, shape_for(out.most, 256, pair_count), batch, match.data(),
         out.most, out.match.data(), out.count.data());
  return out;
}

}  // namespace gpureg::cuda
