// SPDX-License-Identifier: BSD-3-Clause
#include "count_inliers.cuh"
#include "entry_of.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kLeaderThreads = 1024;  // few leaders: each should be done soon

/// A warp per hypothesis looks at a few groups and proposes it as one of its pair's leaders.
__global__ void __launch_bounds__(kProbeThreads) probe(ScoreBatch b) {
  __shared__ Limits limits[512];
  load_limits(b.limits, limits);
  const std::uint32_t total = b.offset[b.pair_count], warps = gridDim.x * (kProbeThreads / 32), lane = threadIdx.x % 32;
  for (std::uint32_t h = (blockIdx.x * kProbeThreads + threadIdx.x) / 32; h < total; h += warps) {
    const std::uint32_t p = entry_of(b.offset, b.pair_count, h);
    const ScorePair& pair = b.pairs[p];
    std::uint32_t possible = 0;
    const bool look = b.valid[h] && pair.cells.nx > 0;
    if (look) {
      const Rigid rigid = to_rigid(b.poses[h]);
      const CellMotion motion(rigid, pair.cells);
      bool certain;
#pragma unroll
      for (std::uint32_t g = 0; g < kProbeGroups; ++g) {
        if (g >= pair.order.groups) break;
        const std::uint32_t cell = motion.locate(__ldg(pair.order.point + g * 32 + lane), pair.cells.block).cell();
        possible += may_be_inlier(rigid, limits + pair.limits * 256, __ldg(pair.cells.word + cell),
                                  __ldg(pair.order.normal + g * 32 + lane), certain);
      }
      possible = warp_sum(possible);
    }
    if (lane != 0) continue;
    b.possible[h] = possible;
    if (!look) continue;
    const std::uint32_t number = h - b.offset[p];
    unsigned long long* leader = b.leaders + static_cast<std::size_t>(p) * kLeaders + number % kLeaders;
    const unsigned long long claim = static_cast<unsigned long long>(possible + 1) << 32 | ~number;
    if (claim > *leader) atomicMax(leader, claim);
  }
}

/// What the leaders reach the others must beat.
__global__ void __launch_bounds__(kLeaderThreads) count_leaders(ScoreBatch b) {
  __shared__ Limits limits[512];
  const std::uint32_t p = blockIdx.x / kLeaders;
  const unsigned long long leader = b.leaders[blockIdx.x];
  if (leader == 0) return;
  load_limits(b.limits, limits);
  const ScorePair& pair = b.pairs[p];
  const std::uint32_t inliers = count_by_block(b, pair, limits + pair.limits * 256, b.poses[b.offset[p] + ~static_cast<std::uint32_t>(leader)],
                                               b.misses + b.group_offset[p], b.refuted + b.group_offset[p]);
  if (threadIdx.x == 0 && inliers > 0) atomicMax(b.most + p, inliers);
}

/// Orders the groups of each pair by what the leaders say of them: where points fail first, a hypothesis is given up soonest. A thread block
/// per pair counts for each group how many come before it.
__global__ void __launch_bounds__(kProbeThreads) order_groups(ScoreBatch b) {
  const std::uint32_t begin = b.group_offset[blockIdx.x], groups = b.group_offset[blockIdx.x + 1] - begin;
  for (std::uint32_t g = threadIdx.x; g < groups; g += kProbeThreads) {
    const std::uint32_t misses = b.misses[begin + g], refuted = b.refuted[begin + g];
    std::uint32_t before = 0, before_refuted = 0;
    for (std::uint32_t o = 0; o < groups; ++o) {
      const std::uint32_t m = b.misses[begin + o], r = b.refuted[begin + o];
      const bool probed = o < kProbeGroups;
      before += g < kProbeGroups ? o < g : probed || m > misses || (m == misses && o < g);
      before_refuted += r > refuted || (r == refuted && o < g);
    }
    b.by_misses[begin + before] = g;
    b.by_refuted[begin + before_refuted] = g;
  }
}

}  // namespace

void score_leaders(Exec& exec, const ScoreBatch& batch, std::uint32_t total) {
  const unsigned most_blocks = static_cast<unsigned>(exec.multiprocessors()) * 8;
  probe<<<std::min(blocks_for(static_cast<std::size_t>(total) * 32, kProbeThreads), most_blocks), kProbeThreads, 0, exec.stream()>>>(batch);
  check_launch("probe");
  count_leaders<<<batch.pair_count * kLeaders, kLeaderThreads, 0, exec.stream()>>>(batch);
  check_launch("count_leaders");
  order_groups<<<batch.pair_count, kProbeThreads, 0, exec.stream()>>>(batch);
  check_launch("order_groups");
}

}  // namespace gpureg::cuda
