// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "cuda/common/stages.hpp"
#include "cuda/compatibility/fit_seeds.hpp"
#include "cuda/compatibility/match_set.cuh"
#include "cuda/device/launch.cuh"
#include "cuda/device/warp.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 128, kWarps = kThreads / 32;
constexpr std::uint32_t kTile = 128;  // matches in shared memory at a time
/// Matches of a thread block of count_matches() at most: their weights, at most 2^16 each, sum up
/// in 32 bits.
constexpr std::uint32_t kMatchesPerBlock = 2048;
static_assert(kMatchesPerBlock << 16 >> 16 == kMatchesPerBlock, "weights sum up in 32 bits");

/// A thread block per pair compacts the valid poses, in the order of their seeds.
__global__ void __launch_bounds__(kThreads)
    keep_valid(const std::uint32_t* seed_count, const std::uint32_t* all_seeds,
               const std::uint8_t* valid, const Pose<float>* all_poses, std::uint32_t most,
               Pose<float>* pose, std::uint32_t* seed, MatchEvidence* matches,
               std::uint32_t* count) {
  __shared__ std::uint32_t warp_count[kWarps];
  const std::uint32_t p = blockIdx.x, seeds = seed_count[p], begin = p * most,
                      lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  std::uint32_t written = 0;
  for (std::uint32_t base = 0; base < seeds; base += kThreads) {
    const std::uint32_t s = base + threadIdx.x;
    const bool keep = s < seeds && valid[begin + s];
    const unsigned mask = __ballot_sync(~0u, keep);
    if (lane == 0) warp_count[warp] = static_cast<std::uint32_t>(__popc(static_cast<int>(mask)));
    __syncthreads();
    std::uint32_t to =
        begin + written +
        static_cast<std::uint32_t>(__popc(static_cast<int>(mask & ((1u << lane) - 1))));
    for (std::uint32_t o = 0; o < kWarps; ++o) {
      if (o < warp) to += warp_count[o];
      written += warp_count[o];
    }
    if (keep) {
      pose[to] = all_poses[begin + s];
      seed[to] = all_seeds[begin + s];
      matches[to] = {0, 0, 0};
    }
    __syncthreads();
  }
  if (threadIdx.x == 0) count[p] = written;
}

/// Thread blocks (x: candidates, y: pair, z: part of the matches); a thread per candidate.
__global__ void __launch_bounds__(kThreads)
    count_matches(MatchSetView m, const std::uint32_t* room, const std::uint32_t* match_count,
                  std::uint32_t per_block, std::uint32_t most, const std::uint32_t* candidate_count,
                  float squared_distance, const Pose<float>* pose, MatchEvidence* out) {
  __shared__ float4 tile[2 * kTile];
  const std::uint32_t p = blockIdx.y, first = blockIdx.z * per_block,
                      last = min(match_count[p], first + per_block);
  if (first >= last || blockIdx.x * kThreads >= candidate_count[p]) return;
  const std::uint32_t c = blockIdx.x * kThreads + threadIdx.x;
  const Rigid rigid = to_rigid(pose[p * most + min(c, candidate_count[p] - 1)]);
  std::uint32_t inliers = 0, source = 0, target = 0;
  for (std::uint32_t base = first; base < last; base += kTile) {
    const std::uint32_t size = min(kTile, last - base);
    __syncthreads();
    for (std::uint32_t k = threadIdx.x; k < size; k += kThreads) {
      const std::uint32_t at = room[p] + base + k;
      tile[2 * k] = make_float4(m.px[at], m.py[at], m.pz[at], m.qx[at]);
      tile[2 * k + 1] = make_float4(m.qy[at], m.qz[at], __uint_as_float(m.source_weight[at]),
                                    __uint_as_float(m.target_weight[at]));
    }
    __syncthreads();
    for (std::uint32_t k = 0; k < size; ++k) {
      const float4 a = tile[2 * k], b = tile[2 * k + 1];
      const bool take =
          squared_norm(apply(rigid, {a.x, a.y, a.z}) - Vec3{a.w, b.x, b.y}) < squared_distance;
      inliers += take ? 1u : 0u;
      source += take ? __float_as_uint(b.z) : 0u;
      target += take ? __float_as_uint(b.w) : 0u;
    }
  }
  if (c >= candidate_count[p] || inliers == 0) return;
  MatchEvidence& e = out[p * most + c];
  atomicAdd(reinterpret_cast<unsigned long long*>(&e.source_weight),
            static_cast<unsigned long long>(source));
  atomicAdd(reinterpret_cast<unsigned long long*>(&e.target_weight),
            static_cast<unsigned long long>(target));
  atomicAdd(&e.inliers, inliers);
}

/// Counts the matches that each candidate aligns.
void add_matches(Exec& exec, const MatchSets& matches, Candidates& candidates,
                 const RegistrationSettings& options) {
  const std::size_t pairs = matches.room.entries();
  const std::uint32_t largest = matches.room.largest,
                      candidate_blocks = blocks_for(std::min(candidates.most, largest), kThreads),
                      per_block = items_per_block(exec, candidate_blocks * pairs, largest,
                                                  kMatchesPerBlock, kTile);
  const float squared_distance =
      options.compatibility.consensus_distance * options.compatibility.consensus_distance;
  launch(
      exec, "count_matches", count_matches,
      {{candidate_blocks, static_cast<unsigned>(pairs), blocks_for(largest, per_block)}, kThreads},
      matches.view(), matches.room.on_device.data(), matches.count.data(), per_block,
      candidates.most, candidates.count.data(), squared_distance, candidates.pose.data(),
      candidates.matches.data());
}

/// A thread block per pair.
__global__ void copy_modes(std::uint32_t most, const Mode* modes, const std::uint32_t* mode_count,
                           Pose<float>* pose, std::uint32_t* seed, MatchEvidence* matches,
                           std::uint32_t* count) {
  const std::uint32_t p = blockIdx.x, k = threadIdx.x, size = mode_count[p];
  if (k == 0) count[p] = size;
  if (k >= size) return;
  const std::size_t at = static_cast<std::size_t>(p) * most + k;
  pose[at] = narrow(modes[at].pose);
  seed[at] = modes[at].seed;
  matches[at] = {0, 0, 0};
}

Candidates candidates_of(Exec& exec, std::size_t pairs, std::uint32_t most) {
  const std::size_t places = pairs * most;
  Candidates out;
  out.most = most;
  out.pose = exec.buffer<Pose<float>>(places);
  out.seed = exec.buffer<std::uint32_t>(places);
  out.matches = exec.buffer<MatchEvidence>(places);
  out.coarse_score = exec.buffer<float>(places);
  out.count = exec.filled<std::uint32_t>(pairs, 0);
  return out;
}

}  // namespace

Candidates propose_poses(Exec& exec, const MatchSets& matches, const Seeds& seeds,
                         const RegistrationSettings& options) {
  const std::size_t pairs = matches.room.entries();
  Candidates out = candidates_of(exec, pairs, seeds.most);
  if (matches.room.largest == 0) return out;
  const SeedPoses found = fit_seeds(exec, matches, seeds, options);
  launch(exec, "keep_valid", keep_valid, {static_cast<unsigned>(pairs), kThreads},
         seeds.count.data(), seeds.match.data(), found.valid.data(), found.pose.data(), seeds.most,
         out.pose.data(), out.seed.data(), out.matches.data(), out.count.data());
  add_matches(exec, matches, out, options);
  return out;
}

Candidates candidates_from_modes(Exec& exec, const MatchSets& matches, const Modes& modes,
                                 const RegistrationSettings& options) {
  const std::size_t pairs = matches.room.entries();
  Candidates out = candidates_of(exec, pairs, modes.most);
  if (matches.room.largest == 0) return out;
  static_assert(limits::kMaxModes <= kThreads, "a thread per mode");
  launch(exec, "copy_modes", copy_modes, {static_cast<unsigned>(pairs), kThreads}, modes.most,
         modes.mode.data(), modes.count.data(), out.pose.data(), out.seed.data(),
         out.matches.data(), out.count.data());
  add_matches(exec, matches, out, options);
  return out;
}

}  // namespace gpureg::cuda
