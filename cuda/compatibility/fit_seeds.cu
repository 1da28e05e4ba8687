// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/compatibility/fit_seeds.hpp"

#include <algorithm>

#include "algorithm/fit.hpp"
#include "cuda/compatibility/match_set.cuh"
#include "cuda/compatibility/neighborhoods.hpp"
#include "cuda/device/launch.cuh"
#include "cuda/device/warp.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 128, kWarps = kThreads / 32;
/// Thread blocks of choose_triangles() that a multiprocessor holds at least: without the bound, its
/// registers allow one less.
constexpr int kBlocks = 8;

/// A member of a seed's neighbourhood.
struct Member {
  float4 a, b;  ///< p.xyz q.x, q.yz weight match
  __device__ Vec3 p() const { return {a.x, a.y, a.z}; }
  __device__ Vec3 q() const { return {a.w, b.x, b.y}; }
  __device__ std::uint32_t weight() const { return __float_as_uint(b.z); }
  __device__ std::uint32_t match() const { return __float_as_uint(b.w); }
};

/// Motions, numbers and counts of best_triangle().
constexpr std::size_t kTriangleBytes = kThreads * (sizeof(Rigid) + 8) + 256;
static_assert(limits::kMaxMembers * sizeof(Member) + kTriangleBytes <= 48 * 1024,
              "all members of a seed fit the shared memory of every device");

/// Aligned values of the members of a seed that a pose brings together: what a least-squares fit
/// needs.
struct FitSums {
  float4 rows[4];  ///< covariance row by row, centroid of the source, of the target, count
};
constexpr int kSumValues = sizeof(FitSums) / sizeof(float), kCovariance = 9, kCentroids = 6;
static_assert(kCovariance + kCentroids + 1 == kSumValues, "one lane writes one value");

/// What is known of the pose of a seed.
enum SeedState : std::uint8_t {
  kNoPose,   ///< no triangle determines one
  kRefits,   ///< the next refit may change it
  kFinished  ///< its consensus set determines no pose: the pose stays as it is
};

struct SeedFits {
  MatchSetView matches;
  const std::uint32_t *room, *match_count;
  const std::uint32_t *seed, *seed_count;
  std::uint32_t most_seeds;
  const std::uint32_t* bits;
  std::uint32_t words;
  CompatibilityTest test;
  std::uint32_t max_members, triangles;
  float squared_distance, squared_shortest;
  std::uint64_t random;
  // pairs x most_seeds
  uint2* corners;  ///< the matches that form the best triangle with the seed
  FitSums* sums;
  Pose<float>* pose;
  std::uint8_t* state;
};

/// The points of a match of the whole batch, and the sum of its weights.
__device__ Member member_at(const MatchSetView& m, std::uint32_t at) {
  return {__ldg(&m.rows[at].points[0]), __ldg(&m.rows[at].points[1])};
}

/// The match of a member, with its normals.
__device__ OrientedMatch oriented(const Member& member, const MatchSetView& m, std::uint32_t at) {
  const float4 a = __ldg(&m.rows[at].normals[0]), b = __ldg(&m.rows[at].normals[1]);
  return {member.p(), member.q(), {a.x, a.y, a.z}, {a.w, b.x, b.y}};
}

/// Position of a thread among those of its block that keep something; count: how many keep.
/// scratch: shared memory, free again after the next __syncthreads().
__device__ std::uint32_t place_in_block(bool keep, std::uint32_t* scratch, std::uint32_t& count) {
  const std::uint32_t lane = threadIdx.x % 32, warp = threadIdx.x / 32;
  const unsigned mask = __ballot_sync(~0u, keep);
  if (lane == 0) scratch[warp] = static_cast<std::uint32_t>(__popc(static_cast<int>(mask)));
  __syncthreads();
  std::uint32_t place =
      static_cast<std::uint32_t>(__popc(static_cast<int>(mask & ((1u << lane) - 1))));
  count = 0;
  for (std::uint32_t o = 0; o < kWarps; ++o) {
    if (o < warp) place += scratch[o];
    count += scratch[o];
  }
  return place;
}

/// Lists the seed and the first of its compatible matches, in their order: put(place, match).
/// Returns their number.
template <typename Put>
__device__ std::uint32_t list_members(const SeedFits& b, std::uint32_t p, std::uint32_t s,
                                      std::uint32_t seed, const Put& put) {
  __shared__ std::uint32_t warp_count[kWarps];
  const std::uint32_t lane = threadIdx.x % 32, warp = threadIdx.x / 32,
                      words = (b.match_count[p] + 31) / 32;
  const std::uint32_t* bits = b.bits + (static_cast<std::size_t>(p) * b.most_seeds + s) * b.words;
  std::uint32_t size = 1;
  if (threadIdx.x == 0) put(0u, seed);
  for (std::uint32_t base = 0; base < words && size < b.max_members; base += kThreads) {
    const std::uint32_t w = base + threadIdx.x;
    std::uint32_t word = w < words ? bits[w] : 0;
    if (w == seed / 32) word &= ~(1u << seed % 32);
    const std::uint32_t own = static_cast<std::uint32_t>(__popc(static_cast<int>(word)));
    std::uint32_t before = warp_prefix_sum(own);
    if (lane == 31) warp_count[warp] = before;
    before += size - own;
    __syncthreads();
    for (std::uint32_t o = 0; o < kWarps; ++o) {
      if (o < warp) before += warp_count[o];
      size += warp_count[o];
    }
    for (; word != 0 && before < b.max_members; word &= word - 1, ++before)
      put(before, w * 32 + static_cast<std::uint32_t>(__ffs(static_cast<int>(word))) - 1);
    __syncthreads();
  }
  __syncthreads();
  return min(size, b.max_members);
}

__device__ std::uint32_t gather_members(const SeedFits& b, std::uint32_t p, std::uint32_t s,
                                        std::uint32_t seed, Member* members) {
  const std::uint32_t size =
      list_members(b, p, s, seed, [&](std::uint32_t place, std::uint32_t match) {
        members[place].b.w = __uint_as_float(match);
      });
  // Two lanes read the halves of a member, which lie in one sector.
  for (std::uint32_t t = threadIdx.x; t < 2 * size; t += kThreads) {
    Member& member = members[t / 2];
    const float match = member.b.w;
    const MatchRow& row = b.matches.rows[b.room[p] + __float_as_uint(match)];
    float4 half = __ldg(row.points + t % 2);
    if (t % 2 == 1) half.w = match;
    (t % 2 == 0 ? member.a : member.b) = half;
  }
  __syncthreads();
  return size;
}

__device__ TrianglePick triangle(const SeedFits& b, std::uint32_t seed_at, std::uint32_t trial,
                                 std::uint32_t size) {
  return pick_triangle(b.matches.source[seed_at], b.matches.target[seed_at], trial, b.random, size);
}

/// The motion of a triangle; false where it determines none.
__device__ bool try_triangle(const SeedFits& b, std::uint32_t begin, std::uint32_t seed,
                             std::uint32_t trial, const Member* members, std::uint32_t size,
                             Rigid& rigid) {
  const TrianglePick pick = triangle(b, begin + seed, trial, size);
  const Member m0 = members[0], m1 = members[pick.a], m2 = members[pick.b];
  if (!compatible(oriented(m1, b.matches, begin + m1.match()),
                  oriented(m2, b.matches, begin + m2.match()), b.test))
    return false;
  return wide_triangle(m0.p(), m1.p(), m2.p(), b.squared_shortest) &&
         carry_triangle(m0.p(), m1.p(), m2.p(), m0.q(), m1.q(), m2.q(), rigid);
}

/// Index of the trial with the largest consensus weight, the first of equals; all threads get it.
/// kNoValue: none.
__device__ std::uint32_t best_triangle(const SeedFits& b, std::uint32_t begin, std::uint32_t seed,
                                       const Member* members, std::uint32_t size) {
  __shared__ Rigid motion[kThreads];
  __shared__ std::uint32_t number[kThreads], support[kThreads], warp_count[kWarps];
  __shared__ unsigned long long best;
  if (threadIdx.x == 0) best = 0;
  for (std::uint32_t base = 0; base < b.triangles; base += kThreads) {
    const std::uint32_t trial = base + threadIdx.x;
    Rigid rigid;
    const bool valid =
        trial < b.triangles && try_triangle(b, begin, seed, trial, members, size, rigid);
    support[threadIdx.x] = 0;
    std::uint32_t count = 0;
    const std::uint32_t slot = place_in_block(valid, warp_count, count);
    if (valid) {
      motion[slot] = rigid;
      number[slot] = trial;
    }
    __syncthreads();
    // Threads without triangles of their own share the members with others.
    const std::uint32_t parts = count == 0 ? 0 : kThreads / count;
    const std::uint32_t part = count == 0 ? 0 : threadIdx.x / count,
                        mine = threadIdx.x - part * count;
    if (part < parts) {
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

/// A thread block per seed: the triangle of the seed and two members with the largest consensus.
__global__ void __launch_bounds__(kThreads, kBlocks) choose_triangles(SeedFits b) {
  extern __shared__ float4 shared[];
  Member* members = reinterpret_cast<Member*>(shared);
  const std::uint32_t p = blockIdx.y, s = blockIdx.x;
  if (s >= b.seed_count[p]) return;
  const std::uint32_t begin = b.room[p], place = p * b.most_seeds + s, seed = b.seed[place];
  const std::uint32_t size = gather_members(b, p, s, seed, members);
  const std::uint32_t best = size < 3 ? kNoValue : best_triangle(b, begin, seed, members, size);
  if (threadIdx.x != 0) return;
  if (best == kNoValue) {
    b.corners[place] = make_uint2(kNoValue, kNoValue);
    return;
  }
  const TrianglePick pick = triangle(b, begin + seed, best, size);
  b.corners[place] = make_uint2(members[pick.a].match(), members[pick.b].match());
}

/// A thread per seed: the eigen-decomposition takes as long for 32 seeds as for one.
__global__ void __launch_bounds__(kThreads) fit_triangles(SeedFits b) {
  const std::uint32_t p = blockIdx.y, s = blockIdx.x * kThreads + threadIdx.x;
  if (s >= b.seed_count[p]) return;
  const std::uint32_t begin = b.room[p], place = p * b.most_seeds + s;
  const uint2 corner = b.corners[place];
  std::uint8_t state = kNoPose;
  if (corner.x != kNoValue) {
    const Member m[3] = {member_at(b.matches, begin + b.seed[place]),
                         member_at(b.matches, begin + corner.x),
                         member_at(b.matches, begin + corner.y)};
    const Vec3 source[3] = {m[0].p(), m[1].p(), m[2].p()},
               target[3] = {m[0].q(), m[1].q(), m[2].q()};
    Pose<float> pose;
    if (fit_rigid(source, target, 3, pose)) {
      b.pose[place] = pose;
      state = kRefits;
    }
  }
  b.state[place] = state;
}

/// A thread block per seed: sums over the members that its pose brings together. Each sum adds them
/// in their order, so the first warp makes them all, a sum per lane.
__global__ void __launch_bounds__(kThreads) sum_consensus(SeedFits b) {
  extern __shared__ float4 shared[];
  __shared__ std::uint32_t warp_count[2][kWarps];
  const std::uint32_t p = blockIdx.y, s = blockIdx.x;
  if (s >= b.seed_count[p]) return;
  const std::uint32_t begin = b.room[p], place = p * b.most_seeds + s;
  if (b.state[place] != kRefits) return;
  float* value = reinterpret_cast<float*>(shared);
  std::uint32_t* match = reinterpret_cast<std::uint32_t*>(value + kCentroids * b.max_members);
  const std::uint32_t size =
      list_members(b, p, s, b.seed[place], [&](std::uint32_t k, std::uint32_t m) { match[k] = m; });
  const Rigid rigid = to_rigid(b.pose[place]);
  std::uint32_t n = 0;
  for (std::uint32_t base = 0, turn = 0; base < size; base += kThreads, turn ^= 1) {
    const std::uint32_t k = base + threadIdx.x, at = begin + match[min(k, size - 1)];
    const Member member = member_at(b.matches, at);
    const Vec3 source = member.p(), target = member.q();
    const bool take = k < size && squared_norm(apply(rigid, source) - target) < b.squared_distance;
    std::uint32_t count = 0;
    float* to = value + kCentroids * (n + place_in_block(take, warp_count[turn], count));
    n += count;
    if (!take) continue;
    to[0] = source.x;
    to[1] = source.y;
    to[2] = source.z;
    to[3] = target.x;
    to[4] = target.y;
    to[5] = target.z;
  }
  __syncthreads();
  if (threadIdx.x >= 32) return;
  const std::uint32_t lane = threadIdx.x;
  const float* column = value + lane % kCentroids;
  float sum = 0.0f;
#pragma unroll 16
  for (std::uint32_t k = 0; k < n; ++k) sum += column[k * kCentroids];
  const float centroid = sum * (1.0f / static_cast<float>(n));
  // Lanes beyond the covariance repeat its elements.
  const std::uint32_t i = lane / 3 % 3, j = 3 + lane % 3;
  const float ci = __shfl_sync(~0u, centroid, static_cast<int>(i)),
              cj = __shfl_sync(~0u, centroid, static_cast<int>(j));
  sum = 0.0f;
#pragma unroll 16
  for (std::uint32_t k = 0; k < n; ++k)
    sum = fmaf(value[k * kCentroids + i] - ci, value[k * kCentroids + j] - cj, sum);
  const float own = __shfl_sync(~0u, centroid, static_cast<int>((lane + 32 - kCovariance) % 32));
  if (lane < kSumValues)
    reinterpret_cast<float*>(b.sums + place)[lane] = lane < kCovariance      ? sum
                                                     : lane + 1 < kSumValues ? own
                                                                             : __uint_as_float(n);
}

/// A thread per seed.
__global__ void __launch_bounds__(kThreads) refit(SeedFits b) {
  const std::uint32_t p = blockIdx.y, s = blockIdx.x * kThreads + threadIdx.x;
  if (s >= b.seed_count[p]) return;
  const std::uint32_t place = p * b.most_seeds + s;
  if (b.state[place] != kRefits) return;
  const FitSums& sums = b.sums[place];
  const float4 u = sums.rows[0], v = sums.rows[1], w = sums.rows[2], x = sums.rows[3];
  const float covariance[3][3] = {{u.x, u.y, u.z}, {u.w, v.x, v.y}, {v.z, v.w, w.x}};
  Pose<float> pose;
  if (__float_as_uint(x.w) >= 3 && solve_rigid(covariance, {w.y, w.z, w.w}, {x.x, x.y, x.z}, pose))
    b.pose[place] = pose;
  else
    b.state[place] = kFinished;
}

}  // namespace

SeedPoses fit_seeds(Exec& exec, const MatchSets& matches, const Seeds& seeds,
                    const RegistrationSettings& options) {
  static_assert(kNoPose == 0, "see SeedPoses::valid");
  const CompatibilitySettings& o = options.compatibility;
  const std::size_t pairs = matches.room.entries(), places = pairs * seeds.most;
  SeedPoses out{exec.buffer<Pose<float>>(places), exec.filled<std::uint8_t>(places, kNoPose)};
  const std::uint32_t largest = matches.room.largest;
  if (largest == 0) return out;
  const Neighborhoods neighborhoods = find_neighborhoods(exec, matches, seeds, o);
  const auto corners = exec.buffer<uint2>(places);
  const auto sums = exec.buffer<FitSums>(places);
  SeedFits batch{};
  batch.matches = matches.view();
  batch.room = matches.room.on_device.data();
  batch.match_count = matches.count.data();
  batch.seed = seeds.match.data();
  batch.seed_count = seeds.count.data();
  batch.most_seeds = seeds.most;
  batch.bits = neighborhoods.bits.data();
  batch.words = neighborhoods.words;
  batch.test = test_of(o);
  batch.max_members = o.max_members;
  batch.triangles = o.triangles;
  batch.squared_distance = o.consensus_distance * o.consensus_distance;
  batch.squared_shortest = o.seed_separation * o.seed_separation;
  batch.random = options.seed;
  batch.corners = corners.data();
  batch.sums = sums.data();
  batch.pose = out.pose.data();
  batch.state = out.valid.data();
  const std::uint32_t most_seeds = std::min(seeds.most, largest);
  const unsigned pair_count = static_cast<unsigned>(pairs);
  const dim3 block_each(most_seeds, pair_count),
      thread_each(blocks_for(most_seeds, kThreads), pair_count);
  launch(exec, "choose_triangles", choose_triangles,
         {block_each, kThreads, o.max_members * sizeof(Member)}, batch);
  launch(exec, "fit_triangles", fit_triangles, {thread_each, kThreads}, batch);
  for (std::uint32_t k = 0; k < o.refits; ++k) {
    launch(exec, "sum_consensus", sum_consensus,
           {block_each, kThreads,
            o.max_members * (kCentroids * sizeof(float) + sizeof(std::uint32_t))},
           batch);
    launch(exec, "refit", refit, {thread_each, kThreads}, batch);
  }
  return out;
}

}  // namespace gpureg::cuda
