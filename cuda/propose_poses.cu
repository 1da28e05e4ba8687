// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "algorithm/fit.hpp"
#include "match_set.cuh"
#include "neighborhoods.hpp"
#include "stages.hpp"
#include "warp.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 128, kWarps = kThreads / 32;
constexpr std::uint32_t kTile = 128;  // matches in shared memory at a time
/// Matches of a thread block of count_matches(): their weights, at most 2^16 each, sum up in 32
/// bits.
constexpr std::uint32_t kMatchesPerBlock = 2048;
static_assert(kMatchesPerBlock << 16 >> 16 == kMatchesPerBlock, "weights sum up in 32 bits");

/// A member of a seed's neighbourhood.
struct Member {
  float4 a, b;  ///< p.xyz q.x, q.yz weight match
  __device__ Vec3 p() const { return {a.x, a.y, a.z}; }
  __device__ Vec3 q() const { return {a.w, b.x, b.y}; }
  __device__ std::uint32_t weight() const { return __float_as_uint(b.z); }
  __device__ std::uint32_t match() const { return __float_as_uint(b.w); }
};

static_assert(limits::kMaxMembers <= 65536, "refit() lists members in 16 bits");
static_assert(limits::kMaxMembers * (sizeof(Member) + sizeof(std::uint16_t)) <= 48 * 1024,
              "all members of a seed fit the shared memory of every device");

struct ProposeBatch {
  MatchSetView matches;
  const std::uint32_t *room, *match_count;
  const std::uint32_t *seed, *seed_count;
  std::uint32_t most_seeds;
  const std::uint32_t* bits;
  std::uint32_t words;
  CompatibilityTest test;
  std::uint32_t max_members, triangles, refits;
  float squared_distance, squared_shortest;
  std::uint64_t random;
  Pose<float>* pose;  // pairs x most_seeds
  std::uint8_t* valid;
};

/// Collects the seed and the first of its compatible matches, in their order. Returns their number.
__device__ std::uint32_t gather_members(const ProposeBatch& b, std::uint32_t p, std::uint32_t s,
                                        std::uint32_t seed, Member* members) {
  __shared__ std::uint32_t warp_count[kWarps];
  const std::uint32_t lane = threadIdx.x % 32, warp = threadIdx.x / 32,
                      words = (b.match_count[p] + 31) / 32;
  const std::uint32_t* bits = b.bits + (static_cast<std::size_t>(p) * b.most_seeds + s) * b.words;
  std::uint32_t size = 1;
  if (threadIdx.x == 0) members[0].b.w = __uint_as_float(seed);
  for (std::uint32_t base = 0; base < words && size < b.max_members; base += kThreads) {
    const std::uint32_t w = base + threadIdx.x;
    std::uint32_t word = w < words ? bits[w] : 0;
    if (w == seed / 32) word &= ~(1u << seed % 32);
    const std::uint32_t own = static_cast<std::uint32_t>(__popc(static_cast<int>(word)));
    std::uint32_t before = own;
    for (int step = 1; step < 32; step *= 2) {
      const std::uint32_t other = __shfl_up_sync(~0u, before, static_cast<unsigned>(step));
      if (lane >= static_cast<std::uint32_t>(step)) before += other;
    }
    if (lane == 31) warp_count[warp] = before;
    before += size - own;
    __syncthreads();
    for (std::uint32_t o = 0; o < kWarps; ++o) {
      if (o < warp) before += warp_count[o];
      size += warp_count[o];
    }
    for (; word != 0 && before < b.max_members; word &= word - 1, ++before)
      members[before].b.w =
          __uint_as_float(w * 32 + static_cast<std::uint32_t>(__ffs(static_cast<int>(word))) - 1);
    __syncthreads();
  }
  size = min(size, b.max_members);
  __syncthreads();
  for (std::uint32_t k = threadIdx.x; k < size; k += kThreads) {
    const std::uint32_t match = members[k].match(), at = b.room[p] + match;
    const MatchSetView& m = b.matches;
    members[k] = {
        make_float4(m.px[at], m.py[at], m.pz[at], m.qx[at]),
        make_float4(m.qy[at], m.qz[at], __uint_as_float(m.source_weight[at] + m.target_weight[at]),
                    __uint_as_float(match))};
  }
  __syncthreads();
  return size;
}

__device__ TrianglePick triangle(const ProposeBatch& b, std::uint32_t seed_at, std::uint32_t trial,
                                 std::uint32_t size) {
  return pick_triangle(b.matches.source[seed_at], b.matches.target[seed_at], trial, b.random, size);
}

/// The motion of a triangle; false where it determines none.
__device__ bool try_triangle(const ProposeBatch& b, std::uint32_t begin, std::uint32_t seed,
                             std::uint32_t trial, const Member* members, std::uint32_t size,
                             Rigid& rigid) {
  const TrianglePick pick = triangle(b, begin + seed, trial, size);
  const Member m0 = members[0], m1 = members[pick.a], m2 = members[pick.b];
  if (!compatible(match_at(b.matches, begin + m1.match()), match_at(b.matches, begin + m2.match()),
                  b.test))
    return false;
  return wide_triangle(m0.p(), m1.p(), m2.p(), b.squared_shortest) &&
         carry_triangle(m0.p(), m1.p(), m2.p(), m0.q(), m1.q(), m2.q(), rigid);
}

/// Index of the trial with the largest consensus weight, the first of equals; all threads get it.
/// kNoValue: none.
__device__ std::uint32_t best_triangle(const ProposeBatch& b, std::uint32_t begin,
                                       std::uint32_t seed, const Member* members,
                                       std::uint32_t size) {
  __shared__ Rigid motion[kThreads];
  __shared__ std::uint32_t number[kThreads], support[kThreads], warp_count[kWarps];
  __shared__ unsigned long long best;
  const std::uint32_t lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  if (threadIdx.x == 0) best = 0;
  for (std::uint32_t base = 0; base < b.triangles; base += kThreads) {
    const std::uint32_t trial = base + threadIdx.x;
    Rigid rigid;
    const bool valid =
        trial < b.triangles && try_triangle(b, begin, seed, trial, members, size, rigid);
    const unsigned mask = __ballot_sync(~0u, valid);
    if (lane == 0) warp_count[warp] = static_cast<std::uint32_t>(__popc(static_cast<int>(mask)));
    support[threadIdx.x] = 0;
    __syncthreads();
    std::uint32_t slot = static_cast<std::uint32_t>(
                      __popc(static_cast<int>(mask & ((1u << lane) - 1)))),
                  count = 0;
    for (std::uint32_t o = 0; o < kWarps; ++o) {
      if (o < warp) slot += warp_count[o];
      count += warp_count[o];
    }
    if (valid) {
      motion[slot] = rigid;
      number[slot] = trial;
    }
    __syncthreads();
    // Warps without triangles of their own share the members with others.
    const std::uint32_t rows = (count + 31) / 32, parts = rows == 1 ? 4 : rows == 2 ? 2 : 1;
    const std::uint32_t mine = warp % max(rows, 1u) * 32 + lane, part = warp / max(rows, 1u);
    if (mine < count && part < parts) {
      const Rigid own = motion[mine];
      std::uint32_t sum = 0;
      for (std::uint32_t k = part * size / parts, end = (part + 1) * size / parts; k < end; ++k) {
        const Member m = members[k];
        sum += squared_norm(apply(own, m.p()) - m.q()) < b.squared_distance ? m.weight() : 0u;
      }
      if (sum > 0) atomicAdd(support + mine, sum);
    }
    __syncthreads();
    if (threadIdx.x < count && support[threadIdx.x] > 0)
      atomicMax(&best,
                static_cast<unsigned long long>(support[threadIdx.x]) << 32 | ~number[threadIdx.x]);
    __syncthreads();
  }
  return best == 0 ? kNoValue : ~static_cast<std::uint32_t>(best);
}

/// Least-squares fit to the members that the pose aligns, by one warp: the lanes share the sums,
/// and each iterates over the members in their order. All lanes get the pose. list: space for all
/// members.
__device__ bool refit(const Member* members, std::uint32_t size, float squared_distance,
                      std::uint16_t* list, Pose<float>& pose) {
  const std::uint32_t lane = threadIdx.x % 32;
  const Rigid rigid = to_rigid(pose);
  std::uint32_t n = 0;
  for (std::uint32_t base = 0; base < size; base += 32) {
    const std::uint32_t k = base + lane;
    const bool take =
        k < size && squared_norm(apply(rigid, members[k].p()) - members[k].q()) < squared_distance;
    const unsigned mask = __ballot_sync(~0u, take);
    if (take)
      list[n + static_cast<std::uint32_t>(__popc(static_cast<int>(mask & ((1u << lane) - 1))))] =
          static_cast<std::uint16_t>(k);
    n += static_cast<std::uint32_t>(__popc(static_cast<int>(mask)));
  }
  __syncwarp();
  if (n < 3) return false;
  const float* value = reinterpret_cast<const float*>(members);
  constexpr std::uint32_t kStride = sizeof(Member) / sizeof(float);
  const float* column = value + lane % 6;
  float sum = 0.0f;
#pragma unroll 8
  for (std::uint32_t k = 0; k < n; ++k) sum += column[list[k] * kStride];
  sum *= 1.0f / static_cast<float>(n);
  const Vec3 cp{__shfl_sync(~0u, sum, 0), __shfl_sync(~0u, sum, 1), __shfl_sync(~0u, sum, 2)};
  const Vec3 cq{__shfl_sync(~0u, sum, 3), __shfl_sync(~0u, sum, 4), __shfl_sync(~0u, sum, 5)};
  const std::uint32_t i = lane / 3 % 3, j = lane % 3;
  const float ci = i == 0 ? cp.x : i == 1 ? cp.y : cp.z, cj = j == 0 ? cq.x : j == 1 ? cq.y : cq.z;
  const float *row = value + i, *other = value + 3 + j;
  sum = 0.0f;
#pragma unroll 8
  for (std::uint32_t k = 0; k < n; ++k)
    sum = fmaf(row[list[k] * kStride] - ci, other[list[k] * kStride] - cj, sum);
  float s[3][3];
#pragma unroll
  for (int k = 0; k < 9; ++k) s[k / 3][k % 3] = __shfl_sync(~0u, sum, k);
  __syncwarp();  // the next call overwrites the list
  return solve_rigid(s, cp, cq, pose);
}

/// A thread block per seed.
__global__ void __launch_bounds__(kThreads) fit_seeds(ProposeBatch b) {
  extern __shared__ float4 shared[];
  Member* members = reinterpret_cast<Member*>(shared);
  std::uint16_t* list = reinterpret_cast<std::uint16_t*>(members + b.max_members);
  const std::uint32_t p = blockIdx.y, s = blockIdx.x;
  if (s >= b.seed_count[p]) return;
  const std::uint32_t begin = b.room[p], place = p * b.most_seeds + s, seed = b.seed[place];
  const std::uint32_t size = gather_members(b, p, s, seed, members);
  if (size < 3) return;
  const std::uint32_t best = best_triangle(b, begin, seed, members, size);
  if (best == kNoValue || threadIdx.x >= 32) return;
  const TrianglePick pick = triangle(b, begin + seed, best, size);
  const Vec3 source[3] = {members[0].p(), members[pick.a].p(), members[pick.b].p()};
  const Vec3 target[3] = {members[0].q(), members[pick.a].q(), members[pick.b].q()};
  Pose<float> pose;
  if (!fit_rigid(source, target, 3, pose)) return;
  for (std::uint32_t k = 0; k < b.refits; ++k)
    if (!refit(members, size, b.squared_distance, list, pose)) break;
  if (threadIdx.x != 0) return;
  b.pose[place] = pose;
  b.valid[place] = 1;
}

/// A thread block per pair compacts the valid poses, in the order of their seeds.
__global__ void __launch_bounds__(kThreads)
    keep_valid(ProposeBatch b, Pose<float>* pose, std::uint32_t* seed, MatchEvidence* matches,
               std::uint32_t* count) {
  __shared__ std::uint32_t warp_count[kWarps];
  const std::uint32_t p = blockIdx.x, seeds = b.seed_count[p], begin = p * b.most_seeds,
                      lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  std::uint32_t written = 0;
  for (std::uint32_t base = 0; base < seeds; base += kThreads) {
    const std::uint32_t s = base + threadIdx.x;
    const bool keep = s < seeds && b.valid[begin + s];
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
      pose[to] = b.pose[begin + s];
      seed[to] = b.seed[begin + s];
      matches[to] = {0, 0, 0};
    }
    __syncthreads();
  }
  if (threadIdx.x == 0) count[p] = written;
}

/// Thread blocks (x: candidates, y: pair, z: part of the matches); a thread per candidate.
__global__ void __launch_bounds__(kThreads)
    count_matches(MatchSetView m, const std::uint32_t* room, const std::uint32_t* match_count,
                  std::uint32_t most, const std::uint32_t* candidate_count, float squared_distance,
                  const Pose<float>* pose, MatchEvidence* out) {
  __shared__ float4 tile[2 * kTile];
  const std::uint32_t p = blockIdx.y, first = blockIdx.z * kMatchesPerBlock,
                      last = min(match_count[p], first + kMatchesPerBlock);
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

}  // namespace

Candidates propose_poses(Exec& exec, const MatchSets& matches, const Seeds& seeds,
                         const RegistrationOptions& options) {
  const std::size_t pairs = matches.room.entries(), places = pairs * seeds.most;
  const unsigned pair_count = static_cast<unsigned>(pairs);
  Candidates out;
  out.most = seeds.most;
  out.pose = exec.buffer<Pose<float>>(places);
  out.seed = exec.buffer<std::uint32_t>(places);
  out.matches = exec.buffer<MatchEvidence>(places);
  out.coarse_score = exec.buffer<float>(places);
  out.count = exec.filled<std::uint32_t>(pairs, 0);
  const std::uint32_t largest = matches.room.largest;
  if (largest == 0) return out;
  const Neighborhoods neighborhoods =
      find_neighborhoods(exec, matches, seeds, options.compatibility);
  const auto pose = exec.buffer<Pose<float>>(places);
  const auto valid = exec.filled<std::uint8_t>(places, 0);
  const float squared_distance =
      options.compatibility.consensus_distance * options.compatibility.consensus_distance;
  ProposeBatch batch{};
  batch.matches = matches.view();
  batch.room = matches.room.on_device.data();
  batch.match_count = matches.count.data();
  batch.seed = seeds.match.data();
  batch.seed_count = seeds.count.data();
  batch.most_seeds = seeds.most;
  batch.bits = neighborhoods.bits.data();
  batch.words = neighborhoods.words;
  batch.test = test_of(options.compatibility);
  batch.max_members = options.compatibility.max_members;
  batch.triangles = options.compatibility.triangles;
  batch.refits = options.compatibility.refits;
  batch.squared_distance = squared_distance;
  batch.squared_shortest =
      options.compatibility.seed_separation * options.compatibility.seed_separation;
  batch.random = options.seed;
  batch.pose = pose.data();
  batch.valid = valid.data();
  const std::size_t shared =
      options.compatibility.max_members * (sizeof(Member) + sizeof(std::uint16_t));
  const std::uint32_t most_seeds = std::min(seeds.most, largest);
  fit_seeds<<<dim3(most_seeds, pair_count), kThreads, shared, exec.stream()>>>(batch);
  check_launch("fit_seeds");
  keep_valid<<<pair_count, kThreads, 0, exec.stream()>>>(batch, out.pose.data(), out.seed.data(),
                                                         out.matches.data(), out.count.data());
  check_launch("keep_valid");
  count_matches<<<dim3(blocks_for(most_seeds, kThreads), pair_count,
                       blocks_for(largest, kMatchesPerBlock)),
                  kThreads, 0, exec.stream()>>>(batch.matches, batch.room, batch.match_count,
                                                out.most, out.count.data(), squared_distance,
                                                out.pose.data(), out.matches.data());
  check_launch("count_matches");
  return out;
}

}  // namespace gpureg::cuda
