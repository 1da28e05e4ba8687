// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/device/launch.cuh"
#include "cuda/quadruples/count_inliers.cuh"

namespace gpureg::cuda {
namespace {

// Hypotheses of a pair that sample the order of the points: its leaders, and some at equal
// distances.
constexpr std::uint32_t kSamples = 64;
constexpr std::uint32_t kPoses = 8;  // poses per thread, at most
constexpr int kThreads = 256;
constexpr int kOrderThreads = 1024;
constexpr std::uint32_t kKeys = kSamples + 1;

/// Index of a sample among all hypotheses of the batch.
__device__ std::uint32_t hypothesis_of(const ScoreBatch& b, std::uint32_t pair,
                                       std::uint32_t sample) {
  const std::uint32_t begin = b.offset[pair], count = b.offset[pair + 1] - begin;
  const unsigned long long leader = sample < kLeaders ? b.leaders[pair * kLeaders + sample] : 0;
  return begin + (leader != 0 ? ~static_cast<std::uint32_t>(leader)
                              : static_cast<std::uint32_t>(static_cast<std::uint64_t>(sample) *
                                                           count / kSamples));
}

/// A thread per point counts the sampled hypotheses that leave it without a partner by the code of
/// its cell, and those that do so only by its closest point. x: points, y: hypotheses, z: pairs.
/// inliers: of the samples.
__global__ void __launch_bounds__(kThreads)
    try_samples(ScoreBatch b, std::uint32_t poses_a_thread, std::uint32_t* inliers) {
  __shared__ std::uint32_t agreeing[kPoses][64];
  __shared__ Rigid poses[kPoses];
  __shared__ std::uint32_t valid[kPoses];
  __shared__ Limits all_limits[512];
  const std::uint32_t p = blockIdx.z, first_sample = blockIdx.y * poses_a_thread;
  const ScorePair& pair = b.pairs[p];
  if (b.offset[p] == b.offset[p + 1] || pair.cells.nx == 0 ||
      blockIdx.x * kThreads >= pair.order.groups * 32)
    return;
  for (std::uint32_t k = threadIdx.x; k < poses_a_thread * 64; k += kThreads) {
    const std::uint32_t h = hypothesis_of(b, p, first_sample + k / 64);
    const Rigid rigid = to_rigid(b.poses[h]);
    agreeing[k / 64][k % 64] = agreeing_codes(*b.directions, b.code_test, rigid, k % 64);
    if (k % 64 != 0) continue;
    poses[k / 64] = rigid;
    valid[k / 64] = b.valid[h];
  }
  load_limits(b.limits, all_limits);
  const Limits* limits = all_limits + pair.limits * 256;
  const std::uint32_t k = blockIdx.x * kThreads + threadIdx.x;
  if (k >= pair.order.groups * 32) return;
  const float4 point = __ldg(pair.order.point + k);
  const std::uint32_t normal = __ldg(pair.order.normal + k);
  std::uint32_t misses = 0, refuted = 0;
  for (std::uint32_t s = 0; s < poses_a_thread; ++s) {
    if (!valid[s]) continue;
    const BrickMotion motion(poses[s], pair.cells);
    const BrickCell cell = motion.locate(point);
    const BrickWord word = motion.find(cell, pair.cells.run);
    const bool possible = word.there && code_agrees(__ldg(pair.cells.brick + word.number), cell,
                                                    agreeing[s][__float_as_uint(point.w)]);
    bool inlier = false;
    if (possible) {
      const std::uint32_t summary = __ldg(&pair.cells.cell[cell_in_bricks(word, cell)].x);
      bool certain;
      inlier = may_be_inlier(poses[s], limits, summary, normal, certain) &&
               (certain ||
                is_inlier(pair, b.test, poses[s], point, normal, pair.order.index + k, word, cell));
    }
    misses += !possible;
    refuted += possible && !inlier;
    const unsigned found = __ballot_sync(~0u, inlier);
    if (threadIdx.x % 32 == 0 && found != 0)
      atomicAdd(inliers + p * kSamples + first_sample + s,
                static_cast<std::uint32_t>(__popc(static_cast<int>(found))));
  }
  const std::size_t first = b.group_offset[p];
  misses = warp_sum(misses);
  if (threadIdx.x % 32 == 0 && misses > 0) atomicAdd(b.misses + first + k / 32, misses);
  if (refuted > 0) atomicAdd(b.refuted + first * 32 + k, refuted);
}

/// A thread block per pair sorts. Samples: their inliers are known now. Groups: each counts the
/// groups before it. Points: counting sort, stable, so that neighbours stay together; each warp has
/// a contiguous range.
__global__ void __launch_bounds__(kOrderThreads)
    sort_by_failures(ScoreBatch b, const std::uint32_t* inliers) {
  constexpr std::uint32_t kWarps = kOrderThreads / 32;
  __shared__ std::uint32_t place[kKeys][kWarps];
  __shared__ std::uint32_t of_key[kKeys];
  const std::uint32_t p = blockIdx.x, begin = b.group_offset[p],
                      groups = b.group_offset[p + 1] - begin;
  const ScorePair& pair = b.pairs[p];
  if (b.offset[p] == b.offset[p + 1] || pair.cells.nx == 0) return;
  if (threadIdx.x < kSamples) {
    const std::uint32_t h = hypothesis_of(b, p, threadIdx.x);
    if (b.valid[h]) {
      b.inliers[h] = inliers[p * kSamples + threadIdx.x];
      atomicMax(b.most + p, b.inliers[h]);
    }
  }
  for (std::uint32_t g = threadIdx.x; g < groups; g += kOrderThreads) {
    const std::uint32_t misses = b.misses[begin + g];
    std::uint32_t before = 0;
    for (std::uint32_t o = 0; o < groups; ++o) {
      const std::uint32_t m = b.misses[begin + o];
      before += m > misses || (m == misses && o < g);
    }
    b.by_misses[begin + before] = g;
  }
  const std::uint32_t* refuted = b.refuted + std::size_t(begin) * 32;
  const std::uint32_t warp = threadIdx.x / 32, lane = threadIdx.x % 32,
                      stretch = (groups + kWarps - 1) / kWarps * 32;
  const std::uint32_t first = min(warp * stretch, groups * 32),
                      last = min(first + stretch, groups * 32);
  for (std::uint32_t k = threadIdx.x; k < kKeys * kWarps; k += kOrderThreads) (&place[0][0])[k] = 0;
  __syncthreads();
  // Most refuted: key 0.
  const auto key_of = [&](std::uint32_t k) { return kSamples - min(refuted[k], kSamples); };
  for (std::uint32_t k = first + lane; k < last; k += 32) atomicAdd(&place[key_of(k)][warp], 1u);
  __syncthreads();
  if (threadIdx.x < kKeys) {
    std::uint32_t sum = 0;
    for (std::uint32_t w = 0; w < kWarps; ++w) {
      const std::uint32_t n = place[threadIdx.x][w];
      place[threadIdx.x][w] = sum;
      sum += n;
    }
    of_key[threadIdx.x] = sum;
  }
  __syncthreads();
  if (threadIdx.x == 0) {
    std::uint32_t sum = 0;
    for (std::uint32_t key = 0; key < kKeys; ++key) {
      const std::uint32_t n = of_key[key];
      of_key[key] = sum;
      sum += n;
    }
  }
  __syncthreads();
  const LookOrder look = b.look_of(p);
  for (std::uint32_t k = first + lane; k < last; k += 32) {
    const std::uint32_t key = key_of(k);
    std::uint32_t same = ~0u;  // lanes with the same key
#pragma unroll
    for (int bit = 0; bit < 7; ++bit) {
      const bool one = (key >> bit & 1) != 0;
      const std::uint32_t ones = __ballot_sync(~0u, one);
      same &= one ? ones : ~ones;
    }
    const std::uint32_t before =
        static_cast<std::uint32_t>(__popc(static_cast<int>(same & ((1u << lane) - 1))));
    const std::uint32_t to = of_key[key] + place[key][warp] + before;
    __syncwarp();
    if (before == 0) place[key][warp] += static_cast<std::uint32_t>(__popc(static_cast<int>(same)));
    __syncwarp();
    look.point[to] = pair.order.point[k];
    const std::uint32_t i = pair.order.index[k];
    const Vec3 n = i != kNoValue ? pair.source.normals[i] : Vec3{0, 0, 0};
    look.normal[to] = make_float4(n.x, n.y, n.z, is_zero(n) ? 0.0f : 1.0f);
    look.index[to] = i;
  }
}

}  // namespace

void score_samples(Exec& exec, const ScoreBatch& batch, std::uint32_t most_groups) {
  if (most_groups == 0) return;
  const auto inliers =
      exec.filled<std::uint32_t>(static_cast<std::size_t>(batch.pair_count) * kSamples, 0);
  const std::uint32_t poses = batch.pair_count < 8 ? 2 : kPoses;  // few pairs: more threads
  launch(exec, "try_samples", try_samples,
         {{blocks_for(std::size_t(most_groups) * 32, kThreads), kSamples / poses, batch.pair_count},
          kThreads},
         batch, poses, inliers.data());
  launch(exec, "sort_by_failures", sort_by_failures, {batch.pair_count, kOrderThreads}, batch,
         inliers.data());
}

}  // namespace gpureg::cuda
