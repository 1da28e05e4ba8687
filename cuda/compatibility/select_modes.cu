// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/evidence.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

constexpr std::uint32_t kFewThreads = 256, kThreads = 1024;
static_assert(limits::kMaxSeeds <= 32 * kFewThreads, "a thread marks its candidates in one word");

/// A thread block per pair takes the candidate with the highest coarse score, the first of equals,
/// drops all candidates of the same mode, and repeats: the result of the CPU, which processes them
/// in order.
__global__ void __launch_bounds__(kThreads)
    select(std::uint32_t most, const std::uint32_t* count, const Pose<float>* poses,
           const float* coarse_scores, const std::uint32_t* seeds, ModeSelection selection,
           Mode* modes, std::uint32_t* mode_count) {
  __shared__ unsigned long long warp_best[kThreads / 32];
  const std::uint32_t p = blockIdx.x, size = count[p], threads = blockDim.x;
  const std::size_t begin = static_cast<std::size_t>(p) * most;
  std::uint32_t left = 0;
  for (std::uint32_t r = 0; r * threads + threadIdx.x < size; ++r) left |= 1u << r;
  std::uint32_t taken = 0;
  float least = 0.0f;
  for (; taken < selection.most; ++taken) {
    unsigned long long best = 0;
    for (std::uint32_t bits = left; bits != 0; bits &= bits - 1) {
      const std::uint32_t k =
          (static_cast<std::uint32_t>(__ffs(static_cast<int>(bits))) - 1) * threads + threadIdx.x;
      // Scores are not negative, so their bits have their order.
      best = max(
          best,
          static_cast<unsigned long long>(__float_as_uint(coarse_scores[begin + k])) << 32 | ~k);
    }
    for (int step = 16; step > 0; step /= 2) best = max(best, __shfl_xor_sync(~0u, best, step));
    if (threadIdx.x % 32 == 0) warp_best[threadIdx.x / 32] = best;
    __syncthreads();
    best = 0;
    for (std::uint32_t w = 0; w < threads / 32; ++w) best = max(best, warp_best[w]);
    __syncthreads();
    if (best == 0) break;
    const float score = __uint_as_float(static_cast<std::uint32_t>(best >> 32));
    if (taken == 0) least = least_score(selection, score);
    if (taken >= selection.certain && score < least) break;
    const std::uint32_t winner = ~static_cast<std::uint32_t>(best);
    const Rigid one = to_rigid(poses[begin + winner]);
    if (threadIdx.x == 0)
      modes[static_cast<std::size_t>(p) * selection.most + taken] = {widen(poses[begin + winner]),
                                                                     seeds[begin + winner], 0};
    for (std::uint32_t bits = left; bits != 0; bits &= bits - 1) {
      const int r = __ffs(static_cast<int>(bits)) - 1;
      const std::uint32_t k = static_cast<std::uint32_t>(r) * threads + threadIdx.x;
      if (k == winner || same_mode(to_rigid(poses[begin + k]), one, selection.within))
        left &= ~(1u << r);
    }
  }
  if (threadIdx.x == 0) mode_count[p] = taken;
}

}  // namespace

Modes select_modes(Exec& exec, const Candidates& candidates, const ModeSelection& selection) {
  const std::size_t pairs = candidates.count.size();
  Modes out;
  out.most = selection.most;
  out.mode = exec.buffer<Mode>(pairs * out.most);
  out.count = exec.buffer<std::uint32_t>(pairs);
  const unsigned threads = candidates.most > kThreads / 2 ? kThreads : kFewThreads;
  launch(exec, "select", select, {static_cast<unsigned>(pairs), threads}, candidates.most,
         candidates.count.data(), candidates.pose.data(), candidates.coarse_score.data(),
         candidates.seed.data(), selection, out.mode.data(), out.count.data());
  return out;
}

}  // namespace gpureg::cuda
