// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <type_traits>

#include "algorithm/evidence.hpp"
#include "block_sum.cuh"
#include "closest_cells.cuh"
#include "pipeline/conclude.hpp"
#include "stages.hpp"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 128, kWarps = kThreads / 32;
/// Thread blocks of verify_source() that a multiprocessor holds at least: its 58 sums take most of
/// the registers.
constexpr int kSourceBlocks = 3;
constexpr int kSideSums = 14, kInformationSums = 24;

struct VerifyModes {
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

/// Adds the part of one of several blocks; a single block writes.
template <typename T>
__device__ void put(T& out, T value, bool alone) {
  using Atomic = std::conditional_t<sizeof(T) == 8, unsigned long long, unsigned>;
  if (alone)
    out = value;
  else
    atomicAdd(reinterpret_cast<Atomic*>(&out), static_cast<Atomic>(value));
}
__device__ void put(SideEvidence& out, const SideEvidence& e, bool alone) {
  put(out.normal_weighted, e.normal_weighted, alone);
  put(out.residual, e.residual, alone);
  put(out.incidence_observed, e.incidence_observed, alone);
  put(out.incidence_violating, e.incidence_violating, alone);
  put(out.tested, e.tested, alone);
  put(out.inliers, e.inliers, alone);
  put(out.hits, e.hits, alone);
  put(out.observed, e.observed, alone);
  put(out.violating, e.violating, alone);
  put(out.occluded, e.occluded, alone);
  put(out.near_surface, e.near_surface, alone);
  put(out.front_violation_near, e.front_violation_near, alone);
  put(out.front_violation_far, e.front_violation_far, alone);
  put(out.behind_surface, e.behind_surface, alone);
}
__device__ void put(Moments& out, const Moments& m, bool alone) {
  put(out.count, m.count, alone);
  for (int k = 0; k < 3; ++k) put(out.sum[k], m.sum[k], alone);
  for (int k = 0; k < 6; ++k) put(out.outer[k], m.outer[k], alone);
}

/// Sum over the block, in thread 0.
__device__ SideEvidence of_block(const SideEvidence& e, std::int64_t* scratch) {
  std::int64_t v[kSideSums];
  v[0] = static_cast<std::int64_t>(e.normal_weighted);
  v[1] = static_cast<std::int64_t>(e.residual);
  v[2] = static_cast<std::int64_t>(e.incidence_observed);
  v[3] = static_cast<std::int64_t>(e.incidence_violating);
  v[4] = e.tested;
  v[5] = e.inliers;
  v[6] = e.hits;
  v[7] = e.observed;
  v[8] = e.violating;
  v[9] = e.occluded;
  v[10] = e.near_surface;
  v[11] = e.front_violation_near;
  v[12] = e.front_violation_far;
  v[13] = e.behind_surface;
  block_sum(v, scratch);
  SideEvidence sum{};
  sum.normal_weighted = static_cast<std::uint64_t>(v[0]);
  sum.residual = static_cast<std::uint64_t>(v[1]);
  sum.incidence_observed = static_cast<std::uint64_t>(v[2]);
  sum.incidence_violating = static_cast<std::uint64_t>(v[3]);
  sum.tested = static_cast<std::uint32_t>(v[4]);
  sum.inliers = static_cast<std::uint32_t>(v[5]);
  sum.hits = static_cast<std::uint32_t>(v[6]);
  sum.observed = static_cast<std::uint32_t>(v[7]);
  sum.violating = static_cast<std::uint32_t>(v[8]);
  sum.occluded = static_cast<std::uint32_t>(v[9]);
  sum.near_surface = static_cast<std::uint32_t>(v[10]);
  sum.front_violation_near = static_cast<std::uint32_t>(v[11]);
  sum.front_violation_far = static_cast<std::uint32_t>(v[12]);
  sum.behind_surface = static_cast<std::uint32_t>(v[13]);
  return sum;
}

__device__ Moments of_block(const Moments& m, std::int64_t* scratch) {
  std::int64_t v[10];
  v[0] = static_cast<std::int64_t>(m.count);
#pragma unroll
  for (int k = 0; k < 3; ++k) v[1 + k] = m.sum[k];
#pragma unroll
  for (int k = 0; k < 6; ++k) v[4 + k] = m.outer[k];
  block_sum(v, scratch);
  Moments sum{};
  sum.count = static_cast<std::uint64_t>(v[0]);
#pragma unroll
  for (int k = 0; k < 3; ++k) sum.sum[k] = v[1 + k];
#pragma unroll
  for (int k = 0; k < 6; ++k) sum.outer[k] = v[4 + k];
  return sum;
}

__device__ MatchEvidence count_matches(const VerifyModes& w, std::uint32_t p, const Rigid& rigid,
                                       std::uint32_t first, std::uint32_t step,
                                       std::int64_t* scratch) {
  std::int64_t v[3] = {0, 0, 0};
  const MatchSetView& m = w.matches;
  for (std::uint32_t k = first; k < w.match_count[p]; k += step) {
    const std::uint32_t at = w.room[p] + k;
    if (!(squared_norm(apply(rigid, {m.px[at], m.py[at], m.pz[at]}) -
                       Vec3{m.qx[at], m.qy[at], m.qz[at]}) < w.squared_distance))
      continue;
    ++v[0];
    v[1] += m.source_weight[at];
    v[2] += m.target_weight[at];
  }
  block_sum(v, scratch);
  return {static_cast<std::uint64_t>(v[1]), static_cast<std::uint64_t>(v[2]),
          static_cast<std::uint32_t>(v[0])};
}

/// Part of a mode that a thread block verifies: points first, first + step, ...
struct Share {
  std::uint32_t p, part, first, step;
  bool alone;
  std::size_t mode;
  __device__ explicit Share(const VerifyModes& w)
      : p(blockIdx.y),
        part(blockIdx.z),
        first(blockIdx.z * kThreads + threadIdx.x),
        step(gridDim.z * kThreads),
        alone(gridDim.z == 1),
        mode(static_cast<std::size_t>(blockIdx.y) * w.most + blockIdx.x) {}
};

/// One or several thread blocks per mode: the points of the target in the source.
__global__ void __launch_bounds__(kThreads) verify_target(VerifyModes w) {
  __shared__ std::int64_t scratch[kWarps * kSideSums];
  const Share share(w);
  if (blockIdx.x >= w.count[share.p]) return;
  const CloudView &s = w.pairs[share.p].source, &t = w.pairs[share.p].target;
  const Rigid back = inverse(to_rigid(w.modes[share.mode].pose));
  SideEvidence side{};
  for (std::uint32_t i = share.first; i < t.size; i += share.step) {
    const Vec3 q = apply(back, t.points[i]);
    verify_found(t, s, back, w.test, s.visibility.count, i, q,
                 find_closest(s, w.pairs[share.p].source_cells, q, w.test.inlier.max_squared),
                 side);
  }
  side = of_block(side, scratch);
  if (threadIdx.x == 0) put(w.out[share.mode].target, side, share.alone);
}

/// One or several thread blocks per mode: the points of the source in the target, the information
/// of the inliers, the moments of the correspondences, and the matches.
__global__ void __launch_bounds__(kThreads, kSourceBlocks) verify_source(VerifyModes w) {
  __shared__ std::int64_t scratch[kWarps * kInformationSums];
  const Share share(w);
  if (blockIdx.x >= w.count[share.p]) return;
  const CloudView &s = w.pairs[share.p].source, &t = w.pairs[share.p].target;
  const Mode& mode = w.modes[share.mode];
  const Rigid there = to_rigid(mode.pose);
  SideEvidence side{};
  InformationSums information{};
  Moments source{}, target{};
  for (std::uint32_t i = share.first; i < s.size; i += share.step) {
    const Vec3 q = apply(there, s.points[i]);
    const VerifiedPoint found = verify_found(
        s, t, there, w.test, t.visibility.count, i, q,
        find_closest(t, w.pairs[share.p].target_cells, q, w.test.inlier.max_squared), side);
    if (found.inlier) add_information(s, there, i, information);
    if (found.closest == kNoValue) continue;
    add_moment(s.points[i] * (1.0f / s.radius), source);
    add_moment(t.points[found.closest] * (1.0f / t.radius), target);
  }
  side = of_block(side, scratch);
  std::int64_t sums[kInformationSums];
#pragma unroll
  for (int k = 0; k < kInformationSums; ++k)
    sums[k] = k < 21 ? information.v[k] : information.arm[k - 21];
  block_sum(sums, scratch);
  source = of_block(source, scratch);
  target = of_block(target, scratch);
  const MatchEvidence matches = count_matches(w, share.p, there, share.first, share.step, scratch);
  if (threadIdx.x != 0) return;
  ModeOutcome& out = w.out[share.mode];
  if (share.part == 0) {
    out.pose = mode.pose;
    out.hypothesis = mode.seed;
    out.iterations = mode.iterations;
  }
  put(out.matches.source_weight, matches.source_weight, share.alone);
  put(out.matches.target_weight, matches.target_weight, share.alone);
  put(out.matches.inliers, matches.inliers, share.alone);
  put(out.source, side, share.alone);
#pragma unroll
  for (int k = 0; k < kInformationSums; ++k)
    put(k < 21 ? out.information.v[k] : out.information.arm[k - 21], sums[k], share.alone);
  put(out.source_moments, source, share.alone);
  put(out.target_moments, target, share.alone);
}

}  // namespace

void verify_modes(Exec& exec, Span<const PairView> pairs, const MatchSets& matches,
                  const Candidates& candidates, const Modes& modes,
                  const RegistrationOptions& options, Span<PairOutcome> outcomes) {
  const auto views = upload_search_pairs(exec, pairs);
  // Filled: unused modes are copied too, and parts are added up.
  const auto verified = exec.filled<ModeOutcome>(pairs.size * modes.most, 0);
  const auto& evidence = options.evidence;
  const EvidenceTest test{
      inlier_test(options.prepare.max_correspondence_distance, evidence.max_normal_angle),
      evidence.free_space_margin, evidence.min_range};
  // Several blocks share a mode where there are too few to fill the device.
  const std::size_t blocks = std::size_t(modes.most) * pairs.size,
                    processors = static_cast<std::size_t>(exec.multiprocessors());
  const unsigned parts =
      static_cast<unsigned>(std::clamp<std::size_t>(8 * processors / blocks, 1, 16));
  VerifyModes batch{};
  batch.pairs = views.data();
  batch.matches = matches.view();
  batch.room = matches.room.on_device.data();
  batch.match_count = matches.count.data();
  batch.most = modes.most;
  batch.modes = modes.mode.data();
  batch.count = modes.count.data();
  batch.test = test;
  batch.squared_distance =
      options.compatibility.consensus_distance * options.compatibility.consensus_distance;
  batch.out = verified.data();
  const dim3 grid(modes.most, static_cast<unsigned>(pairs.size), parts);
  verify_target<<<grid, kThreads, 0, exec.stream()>>>(batch);
  check_launch("verify_target");
  verify_source<<<grid, kThreads, 0, exec.stream()>>>(batch);
  check_launch("verify_source");
  const ModeOutcome* mode = exec.download(verified.data(), verified.size());
  const std::uint32_t* mode_count = exec.download(modes.count.data(), pairs.size);
  const std::uint32_t* match_count = exec.download(matches.count.data(), pairs.size);
  const std::uint64_t* total = exec.download(matches.total.data(), 2 * pairs.size);
  const std::uint32_t* candidate_count = exec.download(candidates.count.data(), pairs.size);
  exec.synchronize();
  for (std::size_t p = 0; p < pairs.size; ++p) {
    PairOutcome& out = outcomes[p];
    out.modes.assign(mode + p * modes.most, mode + p * modes.most + mode_count[p]);
    out.match_weight_source = total[2 * p];
    out.match_weight_target = total[2 * p + 1];
    pipeline::count_seeds(pairs[p].source.size, pairs[p].target.size, match_count[p],
                          candidate_count[p], options, out.statistics);
  }
}

}  // namespace gpureg::cuda
