// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/device/entry_of.cuh"
#include "cuda/device/launch.cuh"
#include "cuda/quadruples/count_inliers.cuh"

namespace gpureg::cuda {
namespace {

constexpr std::uint32_t kProbes = 1024;  // hypotheses of a pair

/// A warp per hypothesis tests a few groups and proposes it as one of the leaders of its pair. Of
/// many hypotheses it takes some at equal distances.
__global__ void __launch_bounds__(kProbeThreads) probe(ScoreBatch b) {
  __shared__ Limits limits[512];
  load_limits(b.limits, limits);
  const std::uint32_t warps = gridDim.x * (kProbeThreads / 32), lane = threadIdx.x % 32;
  for (std::uint32_t k = (blockIdx.x * kProbeThreads + threadIdx.x) / 32;
       k < b.pair_count * kProbes; k += warps) {
    const std::uint32_t p = k / kProbes, count = b.offset[p + 1] - b.offset[p],
                        probes = min(count, kProbes);
    if (k % kProbes >= probes) continue;
    const std::uint32_t number = static_cast<std::uint32_t>(
                            static_cast<std::uint64_t>(k % kProbes) * count / probes),
                        h = b.offset[p] + number;
    const ScorePair& pair = b.pairs[p];
    std::uint32_t possible = 0;
    const bool look = b.valid[h] && pair.cells.nx > 0;
    if (look) {
      const Rigid rigid = to_rigid(b.poses[h]);
      const BrickMotion motion(rigid, pair.cells);
      bool certain;
#pragma unroll
      for (std::uint32_t g = 0; g < kProbeGroups; ++g) {
        if (g >= pair.order.groups) break;
        const BrickCell cell = motion.locate(__ldg(pair.order.point + g * 32 + lane));
        const BrickWord word = motion.find(cell, pair.cells.run);
        possible +=
            word.there && may_be_inlier(rigid, limits + pair.limits * 256,
                                        __ldg(&pair.cells.cell[cell_in_bricks(word, cell)].x),
                                        __ldg(pair.order.normal + g * 32 + lane), certain);
      }
      possible = warp_sum(possible);
    }
    if (lane != 0 || !look) continue;
    unsigned long long* leader = b.leaders + static_cast<std::size_t>(p) * kLeaders + k % kLeaders;
    const unsigned long long claim = static_cast<unsigned long long>(possible + 1) << 32 | ~number;
    if (claim > *leader) atomicMax(leader, claim);
  }
}

}  // namespace

void find_leaders(Exec& exec, const ScoreBatch& batch) {
  const unsigned most_blocks = static_cast<unsigned>(exec.multiprocessors()) * 8;
  launch(exec, "probe", probe,
         {std::min(
              blocks_for(static_cast<std::size_t>(batch.pair_count) * kProbes * 32, kProbeThreads),
              most_blocks),
          kProbeThreads},
         batch);
}

}  // namespace gpureg::cuda
