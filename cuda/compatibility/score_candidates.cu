// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "algorithm/evidence.hpp"
#include "cuda/common/stages.hpp"
#include "cuda/compatibility/compare_point.cuh"
#include "cuda/compatibility/sampled_pairs.hpp"
#include "cuda/device/launch.cuh"
#include "cuda/device/warp.cuh"
#include "pipeline/evidence_test.hpp"

namespace gpureg::cuda {
namespace {

constexpr int kWarps = 4;  // of a thread block, a candidate each
constexpr int kBlocks =
    10;  // of a multiprocessor at least: more warps hide the latency of the search
/// Warps that share a candidate where there are too few candidates to fill the device.
constexpr int kTogether = 8;

/// Normal weight of the sampled points of each cloud: a thread block per cloud (x: pair, y: source
/// or target).
__global__ void __launch_bounds__(256)
    sampled_weight(const SampledPair* pairs, unsigned long long* out) {
  __shared__ unsigned long long sum;
  const CloudView& cloud = blockIdx.y == 0 ? pairs[blockIdx.x].source : pairs[blockIdx.x].target;
  if (threadIdx.x == 0) sum = 0;
  __syncthreads();
  unsigned long long mine = 0;
  for (std::uint32_t i = threadIdx.x; i < cloud.size; i += 256) mine += cloud.normal_weight[i];
  atomicAdd(&sum, mine);
  __syncthreads();
  if (threadIdx.x == 0) out[2 * blockIdx.x + blockIdx.y] = sum;
}

/// Side evidence of one candidate for coarse_score(), by `warps` warps, `warp` of them. moved: the
/// sample of a cloud. Sums of the warp.
__device__ SideEvidence score_sample(std::uint32_t warp, std::uint32_t warps,
                                     const CloudView& moved, const CloudView& other,
                                     const CellSummaries& cells, const Rigid& pose,
                                     const EvidenceTest& test) {
  LaneEvidence mine;
  const std::uint32_t maps = coarse_score_maps(other.visibility);
  for (std::uint32_t i = 32 * warp + threadIdx.x % 32; i < moved.size; i += 32 * warps) {
    compare_point(moved, other, cells, pose, test, maps, i, mine);
  }
  SideEvidence e{};
  e[Term::normal_weighted] = warp_sum(mine.sum[static_cast<int>(Term::normal_weighted)]);
  for (const Term term : {Term::observed, Term::violating}) e[term] = warp_sum(mine.points(term));
  return e;
}

__device__ SideEvidence sum_for_score(SideEvidence a, const SideEvidence& b) {
  for (const Term term : {Term::normal_weighted, Term::observed, Term::violating})
    a[term] += b[term];
  return a;
}

/// kEach warps per candidate: one, or all of a thread block.
template <int kEach>
__global__ void __launch_bounds__(32 * std::max(kEach, kWarps), kEach > 1 ? 4 : kBlocks)
    score(const SampledPair* pairs, const std::uint64_t* match_total,
          const unsigned long long* weight, std::uint32_t most, const std::uint32_t* count,
          const Pose<float>* pose, const MatchEvidence* matches, EvidenceTest test, float* out) {
  const std::uint32_t p = blockIdx.y, warp = threadIdx.x / 32,
                      c = kEach > 1 ? blockIdx.x : blockIdx.x * kWarps + warp;
  if (c >= count[p]) return;
  const std::size_t at = static_cast<std::size_t>(p) * most + c;
  const SampledPair& sampled = pairs[p];
  const SearchPair& pair = sampled.pair;
  const Rigid there = to_rigid(pose[at]), back = inverse(there);
  if (!permitted(pair.prior, there)) {
    if (threadIdx.x % 32 == 0) out[at] = 0.0f;
    return;
  }
  const std::uint32_t part = kEach > 1 ? warp : 0;
  SideEvidence a = score_sample(part, kEach, sampled.source, pair.target, pair.target_cells, there,
                                test),
               b = score_sample(part, kEach, sampled.target, pair.source, pair.source_cells, back,
                                test);
  if constexpr (kEach > 1) {
    __shared__ SideEvidence of_warp[2][kEach];
    if (threadIdx.x % 32 == 0) of_warp[0][warp] = a, of_warp[1][warp] = b;
    __syncthreads();
    if (threadIdx.x > 0) return;
    for (int o = 1; o < kEach; ++o) {
      a = sum_for_score(a, of_warp[0][o]);
      b = sum_for_score(b, of_warp[1][o]);
    }
  }
  if (threadIdx.x % 32 == 0)
    out[at] =
        coarse_score(smaller_share(matches[at], match_total[2 * p], match_total[2 * p + 1]), a,
                     static_cast<float>(weight[2 * p]), b, static_cast<float>(weight[2 * p + 1]));
}

}  // namespace

void score_candidates(Exec& exec, Span<const PairView> pairs, const MatchSets& matches,
                      Candidates& candidates, const RegistrationSettings& options) {
  const std::uint32_t most = std::min(candidates.most, matches.room.largest);
  if (most == 0) return;
  const SampledPairs sampled = sample_pairs(exec, pairs, options.evidence.sample, true);
  const auto weight = exec.buffer<unsigned long long>(2 * pairs.size);
  const unsigned pair_count = static_cast<unsigned>(pairs.size);
  launch(exec, "sampled_weight", sampled_weight, {{pair_count, 2}, 256}, sampled.pairs.data(),
         weight.data());
  const EvidenceTest test = pipeline::evidence_test(options);
  const bool together =
      std::size_t(most) * pairs.size < 16 * static_cast<std::size_t>(exec.multiprocessors());
  launch(exec, "score", (together ? score<kTogether> : score<1>),
         {{together ? most : blocks_for(most, kWarps), pair_count},
          32u * (together ? kTogether : kWarps)},
         sampled.pairs.data(), matches.total.data(), weight.data(), candidates.most,
         candidates.count.data(), candidates.pose.data(), candidates.matches.data(), test,
         candidates.coarse_score.data());
}

}  // namespace gpureg::cuda
