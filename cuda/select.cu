// SPDX-License-Identifier: BSD-3-Clause
#include "entry_of.cuh"
#include "score_batch.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 256;

/// Residuals of those that share the most inliers, and the smallest of each pair.
__global__ void __launch_bounds__(kThreads) measure_ties(ScoreBatch b, unsigned long long* residual, unsigned long long* least) {
  const std::uint32_t total = b.offset[b.pair_count], warps = gridDim.x * (kThreads / 32), lane = threadIdx.x % 32;
  // Ties are few: a warp looks through 32 hypotheses at a time.
  for (std::uint32_t base = (blockIdx.x * kThreads + threadIdx.x) / 32 * 32; base < total; base += warps * 32) {
    const std::uint32_t mine = base + lane;
    std::uint32_t my_pair = 0;
    bool tied = false;
    if (mine < total && b.valid[mine]) {
      my_pair = entry_of(b.offset, b.pair_count, mine);
      tied = b.inliers[mine] == b.most[my_pair];
    }
    for (unsigned left = __ballot_sync(~0u, tied); left != 0; left &= left - 1) {
      const int from = __ffs(static_cast<int>(left)) - 1;
      const std::uint32_t h = base + static_cast<std::uint32_t>(from), p = __shfl_sync(~0u, my_pair, from);
      unsigned long long sum = 0;
      support_by_search(b.pairs[p], b.test, to_rigid(b.poses[h]), sum);
      if (lane != 0) continue;
      residual[h] = sum;
      atomicMin(least + p, sum);
    }
  }
}

/// Of those the first one drawn. Hypotheses are in the order of their numbers, so the first is the lowest.
__global__ void find_first(ScoreBatch b, const unsigned long long* residual, const unsigned long long* least, std::uint32_t* winner) {
  const std::uint32_t h = blockIdx.x * blockDim.x + threadIdx.x;
  if (h >= b.offset[b.pair_count] || !b.valid[h]) return;
  const std::uint32_t p = entry_of(b.offset, b.pair_count, h);
  if (b.inliers[h] == b.most[p] && residual[h] == least[p]) atomicMin(winner + p, h);
}

__global__ void write_best(ScoreBatch b, const unsigned long long* least, const std::uint32_t* winner, BestPose* best) {
  const std::uint32_t p = blockIdx.x * blockDim.x + threadIdx.x;
  if (p >= b.pair_count) return;
  BestPose out{0, 0, {0, 0, 0}, {1, 0, 0, 0, 0, 0, 0}};
  const std::uint32_t h = winner[p];
  if (h != kNoValue) {
    out.found = 1;
    out.support = {b.most[p], b.id[h], least[p]};
    out.pose = widen(b.poses[h]);
  }
  best[p] = out;
}

}  // namespace

DeviceBuffer<BestPose> select_best(Exec& exec, const ScoreBatch& batch, std::uint32_t total) {
  const auto residual = exec.buffer<unsigned long long>(total);
  const auto least = exec.filled<unsigned long long>(batch.pair_count, 0xff);
  const auto winner = exec.filled<std::uint32_t>(batch.pair_count, 0xff);
  auto best = exec.buffer<BestPose>(batch.pair_count);
  if (total > 0) {
    const unsigned full = static_cast<unsigned>(exec.multiprocessors()) * 8;
    measure_ties<<<std::min(blocks_for(total, kThreads), full), kThreads, 0, exec.stream()>>>(batch, residual.data(), least.data());
    check_launch("measure_ties");
    find_first<<<blocks_for(total, kThreads), kThreads, 0, exec.stream()>>>(batch, residual.data(), least.data(), winner.data());
    check_launch("find_first");
  }
  write_best<<<blocks_for(batch.pair_count, 128), 128, 0, exec.stream()>>>(batch, least.data(), winner.data(), best.data());
  check_launch("write_best");
  return best;
}

}  // namespace gpureg::cuda
