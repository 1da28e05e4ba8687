// SPDX-License-Identifier: BSD-3-Clause
#include "entry_of.cuh"
#include "score_batch.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 256;
constexpr int kTieThreads = 1024;  // mostly one tie a pair: the walk over the cloud should be short

/// Lists the hypotheses that share the most inliers of their pair, in any order.
__global__ void __launch_bounds__(kThreads) list_ties(ScoreBatch b, std::uint32_t* ties, std::uint32_t* count) {
  const std::uint32_t h = blockIdx.x * kThreads + threadIdx.x, total = b.offset[b.pair_count];
  const std::uint32_t p = entry_in_block(b.offset, b.pair_count, blockIdx.x * kThreads, h);
  if (h < total && b.valid[h] && b.inliers[h] == b.most[p]) ties[atomicAdd(count, 1u)] = h;
}

/// Their residuals, a thread block each, and the smallest of each pair.
__global__ void __launch_bounds__(kTieThreads) measure_ties(ScoreBatch b, const std::uint32_t* ties, const std::uint32_t* count,
                                                         unsigned long long* residual, unsigned long long* least) {
  __shared__ unsigned long long sum;
  for (std::uint32_t k = blockIdx.x; k < *count; k += gridDim.x) {
    const std::uint32_t h = ties[k], p = entry_of(b.offset, b.pair_count, h);
    __syncthreads();
    if (threadIdx.x == 0) sum = 0;
    __syncthreads();
    std::uint32_t inliers;
    const unsigned long long mine = support_by_search(b.pairs[p], b.test, to_rigid(b.poses[h]), threadIdx.x, kTieThreads, inliers);
    if (mine > 0) atomicAdd(&sum, mine);
    __syncthreads();
    if (threadIdx.x != 0) continue;
    residual[h] = sum;
    atomicMin(least + p, sum);
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
    const auto ties = exec.buffer<std::uint32_t>(total);
    const auto tie_count = exec.filled<std::uint32_t>(1, 0);
    list_ties<<<blocks_for(total, kThreads), kThreads, 0, exec.stream()>>>(batch, ties.data(), tie_count.data());
    check_launch("list_ties");
    const unsigned full = static_cast<unsigned>(exec.multiprocessors()) * 2;
    measure_ties<<<std::min(total, full), kTieThreads, 0, exec.stream()>>>(batch, ties.data(), tie_count.data(), residual.data(), least.data());
    check_launch("measure_ties");
    find_first<<<blocks_for(total, kThreads), kThreads, 0, exec.stream()>>>(batch, residual.data(), least.data(), winner.data());
    check_launch("find_first");
  }
  write_best<<<blocks_for(batch.pair_count, 128), 128, 0, exec.stream()>>>(batch, least.data(), winner.data(), best.data());
  check_launch("write_best");
  return best;
}

}  // namespace gpureg::cuda
