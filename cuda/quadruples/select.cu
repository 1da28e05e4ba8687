// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/device/entry_of.cuh"
#include "cuda/device/launch.cuh"
#include "cuda/quadruples/score_batch.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 256;
// Thread blocks per tied hypothesis: there is mostly one per pair, so its cloud is split.
constexpr std::uint32_t kParts = 8;
constexpr int kRankThreads = 1024;

/// Lists the hypotheses that share the most inliers of their pair, in any order.
__global__ void __launch_bounds__(kThreads)
    list_ties(ScoreBatch b, std::uint32_t* ties, std::uint32_t* count,
              unsigned long long* residual) {
  const std::uint32_t h = blockIdx.x * kThreads + threadIdx.x, total = b.offset[b.pair_count];
  const std::uint32_t p = entry_in_block(b.offset, b.pair_count, blockIdx.x * kThreads, h);
  if (h >= total || !b.valid[h] || b.inliers[h] != b.most[p]) return;
  ties[atomicAdd(count, 1u)] = h;
  residual[h] = 0;
}

/// Their residuals.
__global__ void __launch_bounds__(kThreads)
    measure_ties(ScoreBatch b, const std::uint32_t* ties, const std::uint32_t* count,
                 unsigned long long* residual) {
  const unsigned long long parts = static_cast<unsigned long long>(*count) * kParts;
  for (unsigned long long k = blockIdx.x; k < parts; k += gridDim.x) {
    const std::uint32_t h = ties[k / kParts], p = entry_of(b.offset, b.pair_count, h);
    std::uint32_t inliers;
    const unsigned long long mine =
        support_by_search(b.pairs[p], b.test, to_rigid(b.poses[h]),
                          static_cast<std::uint32_t>(k % kParts) * kThreads + threadIdx.x,
                          kParts * kThreads, inliers);
    if (mine > 0) atomicAdd(residual + h, mine);
  }
}

/// The smallest residual of each pair, and the first drawn of those with it. Hypotheses are in the
/// order of their indices, so the first one is the lowest. One thread block: there are few ties.
__global__ void __launch_bounds__(kRankThreads)
    write_best(ScoreBatch b, const std::uint32_t* ties, const std::uint32_t* count,
               const unsigned long long* residual, unsigned long long* least, std::uint32_t* winner,
               BestPose* best) {
  const std::uint32_t ties_in_all = *count;
  for (std::uint32_t k = threadIdx.x; k < ties_in_all; k += kRankThreads)
    atomicMin(least + entry_of(b.offset, b.pair_count, ties[k]), residual[ties[k]]);
  __syncthreads();
  for (std::uint32_t k = threadIdx.x; k < ties_in_all; k += kRankThreads) {
    const std::uint32_t h = ties[k], p = entry_of(b.offset, b.pair_count, h);
    if (residual[h] == __ldcg(least + p)) atomicMin(winner + p, h);
  }
  __syncthreads();
  for (std::uint32_t p = threadIdx.x; p < b.pair_count; p += kRankThreads) {
    BestPose out{0, 0, {0, 0, 0}, identity_pose<double>()};
    const std::uint32_t h = __ldcg(winner + p);
    if (h != kNoValue) {
      out.found = 1;
      out.support = {b.most[p], b.id[h], __ldcg(least + p)};
      out.pose = widen(b.poses[h]);
    }
    best[p] = out;
  }
}

}  // namespace

DeviceBuffer<BestPose> select_best(Exec& exec, const ScoreBatch& batch, std::uint32_t total) {
  const auto residual = exec.buffer<unsigned long long>(total);
  const auto least = exec.filled<unsigned long long>(batch.pair_count, 0xff);
  const auto winner = exec.filled<std::uint32_t>(batch.pair_count, 0xff);
  auto best = exec.buffer<BestPose>(batch.pair_count);
  const auto ties = exec.buffer<std::uint32_t>(total);
  const auto tie_count = exec.filled<std::uint32_t>(1, 0);
  if (total > 0) {
    launch(exec, "list_ties", list_ties, shape_for(total, kThreads), batch, ties.data(),
           tie_count.data(), residual.data());
    const unsigned full = static_cast<unsigned>(exec.multiprocessors()) * 8;
    launch(exec, "measure_ties", measure_ties, {full, kThreads}, batch, ties.data(),
           tie_count.data(), residual.data());
  }
  launch(exec, "write_best", write_best, {1, kRankThreads}, batch, ties.data(), tie_count.data(),
         residual.data(), least.data(), winner.data(), best.data());
  return best;
}

}  // namespace gpureg::cuda
