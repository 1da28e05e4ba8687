// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "algorithm/evidence.hpp"
#include "block_sum.cuh"
#include "closest_cells.cuh"
#include "stages.hpp"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 256;

struct WeighModes {
  const SearchPair* pairs;
  MatchSetView matches;
  const std::uint32_t *room, *match_count;
  std::uint32_t most;
  const Mode* modes;
  const std::uint32_t* count;
  EvidenceTest test;
  float squared_distance;
  ModeOutcome* out;
};

/// Thread 0 has the whole block's.
__device__ SideEvidence of_block(const SideEvidence& e, std::int64_t* scratch) {
  std::int64_t v[12] = {static_cast<std::int64_t>(e.balanced), static_cast<std::int64_t>(e.residual), e.tested, e.inliers, e.hits, e.seen, e.before, e.hidden,
                        e.around, e.near_front, e.far_front, e.at_back};
  block_sum(v, scratch);
  const auto count = [&](int k) { return static_cast<std::uint32_t>(v[k]); };
  return {static_cast<std::uint64_t>(v[0]), static_cast<std::uint64_t>(v[1]), count(2), count(3), count(4), count(5), count(6), count(7), count(8), count(9), count(10), count(11)};
}

__device__ Moments of_block(const Moments& m, std::int64_t* scratch) {
  std::int64_t v[10] = {static_cast<std::int64_t>(m.count), m.sum[0], m.sum[1], m.sum[2], m.outer[0], m.outer[1], m.outer[2], m.outer[3], m.outer[4], m.outer[5]};
  block_sum(v, scratch);
  return {static_cast<std::uint64_t>(v[0]), {v[1], v[2], v[3]}, {v[4], v[5], v[6], v[7], v[8], v[9]}};
}

__device__ MatchEvidence count_matches(const WeighModes& w, std::uint32_t p, const Rigid& rigid, std::int64_t* scratch) {
  std::int64_t v[3] = {0, 0, 0};
  const MatchSetView& m = w.matches;
  for (std::uint32_t k = threadIdx.x; k < w.match_count[p]; k += kThreads) {
    const std::uint32_t at = w.room[p] + k;
    if (!(squared_norm(apply(rigid, {m.px[at], m.py[at], m.pz[at]}) - Vec3{m.qx[at], m.qy[at], m.qz[at]}) < w.squared_distance)) continue;
    ++v[0], v[1] += m.source_weight[at], v[2] += m.target_weight[at];
  }
  block_sum(v, scratch);
  return {static_cast<std::uint64_t>(v[1]), static_cast<std::uint64_t>(v[2]), static_cast<std::uint32_t>(v[0])};
}

/// A thread block per mode and side (z: 0 moves the source, 1 the target).
__global__ void __launch_bounds__(kThreads) weigh(WeighModes w) {
  __shared__ std::int64_t scratch[kThreads / 32 * 24];
  const std::uint32_t p = blockIdx.y;
  if (blockIdx.x >= w.count[p]) return;
  const CloudView &s = w.pairs[p].source, &t = w.pairs[p].target;
  const std::size_t at = static_cast<std::size_t>(p) * w.most + blockIdx.x;
  const Mode& mode = w.modes[at];
  ModeOutcome& out = w.out[at];
  const Rigid there = to_rigid(mode.pose);
  SideEvidence side{};
  if (blockIdx.z == 1) {
    const Rigid back = inverse(there);
    for (std::uint32_t i = threadIdx.x; i < t.size; i += kThreads) {
      const Vec3 q = apply(back, t.points[i]);
      weigh_found(t, s, back, w.test, s.visibility.count, i, q, find_closest(s, w.pairs[p].source_cells, q, w.test.inlier.max_squared), side);
    }
    side = of_block(side, scratch);
    if (threadIdx.x == 0) out.target = side;
    return;
  }
  InformationSums information{};
  Moments source{}, target{};
  for (std::uint32_t i = threadIdx.x; i < s.size; i += kThreads) {
    const Vec3 q = apply(there, s.points[i]);
    const Weighed found =
        weigh_found(s, t, there, w.test, t.visibility.count, i, q, find_closest(t, w.pairs[p].target_cells, q, w.test.inlier.max_squared), side);
    if (found.inlier) add_information(s, there, i, information);
    if (found.closest == kNoValue) continue;
    add_moment(s.points[i] * (1.0f / s.radius), source);
    add_moment(t.points[found.closest] * (1.0f / t.radius), target);
  }
  side = of_block(side, scratch);
  std::int64_t sums[24];
#pragma unroll
  for (int k = 0; k < 24; ++k) sums[k] = k < 21 ? information.v[k] : information.arm[k - 21];
  block_sum(sums, scratch);
  source = of_block(source, scratch);
  target = of_block(target, scratch);
  const MatchEvidence matches = count_matches(w, p, there, scratch);
  if (threadIdx.x != 0) return;
  out.pose = mode.pose, out.hypothesis = mode.seed, out.iterations = mode.iterations;
  out.matches = matches, out.source = side;
#pragma unroll
  for (int k = 0; k < 24; ++k) (k < 21 ? out.information.v[k] : out.information.arm[k - 21]) = sums[k];
  out.source_moments = source, out.target_moments = target;
}

}  // namespace

void weigh_modes(Exec& exec, Span<const PairView> pairs, const MatchSets& matches, const Candidates& candidates, const Modes& modes,
                 const RegistrationOptions& options, Span<PairOutcome> outcomes) {
  const auto views = upload_search_pairs(exec, pairs);
  // Filled: what no mode is written to is copied along.
  const auto weighed = exec.filled<ModeOutcome>(pairs.size * modes.most, 0);
  const auto& score = options.score;
  const auto& evidence = options.evidence;
  const EvidenceTest test{inlier_test(score.max_correspondence_distance, evidence.max_normal_angle), evidence.free_space_margin, evidence.min_range};
  weigh<<<dim3(modes.most, static_cast<unsigned>(pairs.size), 2), kThreads, 0, exec.stream()>>>(
      WeighModes{views.data(), matches.view(), matches.room.on_device.data(), matches.count.data(), modes.most, modes.mode.data(), modes.count.data(), test,
                 options.compatibility.consensus_distance * options.compatibility.consensus_distance, weighed.data()});
  check_launch("weigh");
  const ModeOutcome* mode = exec.download(weighed.data(), weighed.size());
  const std::uint32_t* mode_count = exec.download(modes.count.data(), pairs.size);
  const std::uint32_t* match_count = exec.download(matches.count.data(), pairs.size);
  const std::uint64_t* total = exec.download(matches.total.data(), 2 * pairs.size);
  const std::uint32_t* candidate_count = exec.download(candidates.count.data(), pairs.size);
  exec.synchronize();
  for (std::size_t p = 0; p < pairs.size; ++p) {
    PairOutcome& out = outcomes[p];
    out.modes.assign(mode + p * modes.most, mode + p * modes.most + mode_count[p]);
    out.match_weight_source = total[2 * p], out.match_weight_target = total[2 * p + 1];
    out.statistics.source_points = pairs[p].source.size, out.statistics.target_points = pairs[p].target.size;
    out.statistics.correspondences = match_count[p];
    out.statistics.hypotheses = std::min(options.compatibility.seeds, match_count[p]);
    out.statistics.survivors = candidate_count[p];
    out.statistics.scored = candidate_count[p];
  }
}

}  // namespace gpureg::cuda
