// SPDX-License-Identifier: BSD-3-Clause
#include "bounds.cuh"
#include "entry_of.cuh"
#include "stages.hpp"
#include "warp.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 256;
constexpr std::uint32_t kProbeGroups = 4;   // groups of 32 points that tell promising hypotheses from others
constexpr std::uint32_t kLeaders = 16;      // promising hypotheses of a pair that are scored first
constexpr std::uint32_t kGrab = 8;          // hypotheses that a warp takes at a time

struct ScoreBatch {
  const ScorePair* pairs;
  std::uint32_t pair_count;
  const std::uint32_t* offset;      // of the pairs' hypotheses
  const Pose<float>* poses;
  const std::uint8_t* valid;
  const std::uint32_t* id;
  InlierTest test;
  const Limits* limits;             // 2 x 256
  std::uint32_t* possible;          // per hypothesis: points of the probe that may be inliers
  std::uint32_t* inliers;           // per hypothesis; 0 where it was given up
  unsigned long long* leaders;      // pairs x kLeaders: (possible, ~number), the largest of each residue class
  std::uint32_t* most;              // per pair: inliers of the best so far
  std::uint32_t* next;              // hypotheses handed out
};

/// One warp's view of one hypothesis.
struct Candidate {
  const ScorePair& pair;
  const InlierTest& test;
  const Limits* limits;             // in shared memory
  Rigid rigid;
  PoseInCells in_cells;
  std::uint32_t lane;

  __device__ Candidate(const ScorePair& p, const InlierTest& t, const Limits* all_limits, const Pose<float>& pose)
      : pair(p), test(t), limits(all_limits + p.limits * 256), rigid(to_rigid(pose)), in_cells(rigid, p.cells), lane(threadIdx.x % 32) {}

  __device__ float4 point(std::uint32_t group) const { return __ldg(pair.order.point + group * 32 + lane); }
  __device__ float4 normal(std::uint32_t group) const { return __ldg(pair.order.normal + group * 32 + lane); }

  /// Points of a group that may be inliers: as many as this lane's bit says, over the warp.
  __device__ bool may_be_inlier(std::uint32_t group, std::uint32_t& cell, Limits& limit, float& cosine, float4& p, float4& n) const {
    p = point(group);
    cell = locate(in_cells, pair.cells, p);
    const std::uint32_t word = __ldg(pair.cells.word + cell);
    if (!__any_sync(~0u, word != 0)) return false;
    n = normal(group);
    cosine = cosine_to_mean(rigid, n, word);
    limit = limits[word >> 24];
    return word != 0 && cosine >= limit.none_below;
  }

  /// Inliers of a group that are possible.
  __device__ std::uint32_t count_possible(std::uint32_t group) const {
    std::uint32_t cell;
    Limits limit;
    float cosine;
    float4 p, n;
    return static_cast<std::uint32_t>(__popc(static_cast<int>(__ballot_sync(~0u, may_be_inlier(group, cell, limit, cosine, p, n)))));
  }

  __device__ bool is_inlier(float4 p, float4 n, std::uint32_t cell, Closest& c) const {
    const Vec3 q = apply(rigid, {p.x, p.y, p.z});
    c = closest_in_cell(pair.target, cell, q, test.max_squared);
    return c.index != kNoValue && normals_agree(rotate(rigid, {n.x, n.y, n.z}), pair.target.normals[c.index], test.min_cosine);
  }
};

/// Clouds too wide for a table of blocks: every point is looked up by its key.
__device__ std::uint32_t inliers_by_search(const Candidate& c, unsigned long long* residual) {
  std::uint32_t inliers = 0;
  unsigned long long sum = 0;
  for (std::uint32_t i = c.lane; i < c.pair.source.size; i += 32) {
    const Closest found = find_closest(c.pair.target.closest, c.pair.target.points, apply(c.rigid, c.pair.source.points[i]), c.test.max_squared);
    if (found.index == kNoValue) continue;
    if (!normals_agree(rotate(c.rigid, c.pair.source.normals[i]), c.pair.target.normals[found.index], c.test.min_cosine)) continue;
    ++inliers;
    sum += fixed_residual(found.squared_distance, c.test.inverse_max_squared);
  }
  if (residual) *residual = static_cast<unsigned long long>(warp_sum(static_cast<std::int64_t>(sum)));
  return warp_sum(inliers);
}

/// Exact number of inliers, or 0 as soon as it cannot reach the most seen so far: such a hypothesis is not the best one. possible: upper
/// bound over the groups before `begin`.
__device__ std::uint32_t count_inliers(const Candidate& c, std::uint32_t begin, std::uint32_t possible, const volatile std::uint32_t* most) {
  if (c.pair.cells.nx == 0) return inliers_by_search(c, nullptr);
  const std::uint32_t groups = c.pair.order.groups;
  std::uint32_t needed = *most;
  for (std::uint32_t g = begin; g < groups; ++g) {
    if (possible + (groups - g) * 32 < needed) return 0;
    possible += c.count_possible(g);
    if (g % 16 == 15) needed = *most;
  }
  for (std::uint32_t g = 0; g < groups; ++g) {
    if (possible < needed) return 0;
    std::uint32_t cell;
    Limits limit;
    float cosine;
    float4 p, n;
    const bool undecided = c.may_be_inlier(g, cell, limit, cosine, p, n) && cosine < limit.all_above;
    const unsigned asked = __ballot_sync(~0u, undecided);
    if (asked == 0) continue;
    bool refuted = undecided;
    if (undecided) {
      Closest closest;
      refuted = !c.is_inlier(p, n, cell, closest);
    }
    possible -= static_cast<std::uint32_t>(__popc(static_cast<int>(__ballot_sync(~0u, refuted))));
    if (g % 16 == 15) needed = *most;
  }
  return possible;
}

__device__ void load_limits(const Limits* from, Limits* to) {
  for (int k = static_cast<int>(threadIdx.x); k < 512; k += kThreads) to[k] = from[k];
  __syncthreads();
}

/// A warp per hypothesis looks at a few groups and proposes it as one of its pair's leaders.
__global__ void __launch_bounds__(kThreads) probe(ScoreBatch b) {
  __shared__ Limits limits[512];
  load_limits(b.limits, limits);
  const std::uint32_t total = b.offset[b.pair_count], warps = gridDim.x * (kThreads / 32);
  for (std::uint32_t h = (blockIdx.x * kThreads + threadIdx.x) / 32; h < total; h += warps) {
    const std::uint32_t p = entry_of(b.offset, b.pair_count, h);
    const ScorePair& pair = b.pairs[p];
    if (!b.valid[h] || pair.cells.nx == 0) {
      if (threadIdx.x % 32 == 0) b.possible[h] = 0;
      continue;
    }
    const Candidate c(pair, b.test, limits, b.poses[h]);
    std::uint32_t possible = 0;
    for (std::uint32_t g = 0; g < min(kProbeGroups, pair.order.groups); ++g) possible += c.count_possible(g);
    if (c.lane != 0) continue;
    b.possible[h] = possible;
    const std::uint32_t number = h - b.offset[p];
    unsigned long long* leader = b.leaders + static_cast<std::size_t>(p) * kLeaders + number % kLeaders;
    const unsigned long long claim = static_cast<unsigned long long>(possible + 1) << 32 | ~number;
    if (claim > *leader) atomicMax(leader, claim);
  }
}

/// A warp per leader: what they reach is what the others must beat.
__global__ void __launch_bounds__(kThreads) score_leaders(ScoreBatch b) {
  __shared__ Limits limits[512];
  load_limits(b.limits, limits);
  const std::uint32_t k = (blockIdx.x * kThreads + threadIdx.x) / 32, p = k / kLeaders;
  if (p >= b.pair_count || b.leaders[k] == 0) return;
  const std::uint32_t h = b.offset[p] + ~static_cast<std::uint32_t>(b.leaders[k]);
  const Candidate c(b.pairs[p], b.test, limits, b.poses[h]);
  const std::uint32_t inliers = count_inliers(c, 0, 0, b.most + p);
  if (c.lane == 0 && inliers > 0) atomicMax(b.most + p, inliers);
}

/// Warps take hypotheses until none is left: how long one takes is not known before.
__global__ void __launch_bounds__(kThreads) score_all(ScoreBatch b) {
  __shared__ Limits limits[512];
  load_limits(b.limits, limits);
  const std::uint32_t total = b.offset[b.pair_count], lane = threadIdx.x % 32;
  for (;;) {
    std::uint32_t first = 0;
    if (lane == 0) first = atomicAdd(b.next, kGrab);
    first = __shfl_sync(~0u, first, 0);
    if (first >= total) return;
    const std::uint32_t last = min(total, first + kGrab);
    for (std::uint32_t h = first; h < last; ++h) {
      std::uint32_t inliers = 0;
      if (b.valid[h]) {
        const std::uint32_t p = entry_of(b.offset, b.pair_count, h);
        const Candidate c(b.pairs[p], b.test, limits, b.poses[h]);
        inliers = count_inliers(c, min(kProbeGroups, c.pair.order.groups), b.possible[h], b.most + p);
        if (lane == 0 && inliers > 0) atomicMax(b.most + p, inliers);
      }
      if (lane == 0) b.inliers[h] = inliers;
    }
  }
}

/// Residuals of those that share the most inliers, and the smallest of each pair.
__global__ void __launch_bounds__(kThreads) measure_ties(ScoreBatch b, unsigned long long* residual, unsigned long long* least) {
  const std::uint32_t total = b.offset[b.pair_count], warps = gridDim.x * (kThreads / 32), lane = threadIdx.x % 32;
  for (std::uint32_t h = (blockIdx.x * kThreads + threadIdx.x) / 32; h < total; h += warps) {
    if (!b.valid[h]) continue;
    const std::uint32_t p = entry_of(b.offset, b.pair_count, h);
    if (b.inliers[h] != b.most[p]) continue;
    const Candidate c(b.pairs[p], b.test, b.limits, b.poses[h]);
    unsigned long long sum = 0;
    inliers_by_search(c, &sum);
    if (lane != 0) continue;
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

std::vector<ScorePair> score_pairs(Span<const PairView> pairs, const ScoreOptions& options) {
  std::vector<ScorePair> out;
  for (const PairView& pair : pairs) {
    const auto& source = *static_cast<const CudaCloud*>(pair.source.executor_data);
    const auto& target = *static_cast<const CudaCloud*>(pair.target.executor_data);
    // The cells know what is in reach of the distance that they were built for; of a shorter one they only know what is not.
    const float built = target.options.search_distance;
    const bool exact = built * built == options.max_correspondence_distance * options.max_correspondence_distance;
    out.push_back({pair.source, pair.target, source.order, target.summaries, exact ? 0u : 1u});
  }
  return out;
}

std::vector<Limits> limit_tables(const ScoreOptions& options) {
  std::vector<Limits> out;
  for (const bool exact : {true, false}) {
    const SummaryLimits limits(options.max_normal_angle, exact);
    for (int code = 0; code < 256; ++code) out.push_back({limits.none_below[code], limits.all_above[code]});
  }
  return out;
}

}  // namespace

DeviceBuffer<BestPose> score_hypotheses(Exec& exec, Span<const PairView> pairs, const Hypotheses& hypotheses, const ScoreOptions& options) {
  const std::uint32_t total = hypotheses.segments->total();
  const std::uint32_t count = static_cast<std::uint32_t>(pairs.size);
  const auto pairs_on_device = exec.upload(score_pairs(pairs, options));
  const auto limits = exec.upload(limit_tables(options));
  const auto possible = exec.buffer<std::uint32_t>(total);
  const auto inliers = exec.buffer<std::uint32_t>(total);
  const auto leaders = exec.filled<unsigned long long>(static_cast<std::size_t>(count) * kLeaders, 0);
  const auto most = exec.filled<std::uint32_t>(count, 0);
  const auto next = exec.filled<std::uint32_t>(1, 0);
  const auto residual = exec.buffer<unsigned long long>(total);
  const auto least = exec.filled<unsigned long long>(count, 0xff);
  const auto winner = exec.filled<std::uint32_t>(count, 0xff);
  auto best = exec.buffer<BestPose>(count);
  const ScoreBatch batch{pairs_on_device.data(), count, hypotheses.segments->on_device.data(), hypotheses.pose.data(), hypotheses.valid.data(),
                         hypotheses.id, inlier_test(options.max_correspondence_distance, options.max_normal_angle), limits.data(),
                         possible.data(), inliers.data(), leaders.data(), most.data(), next.data()};
  if (total > 0) {
    const unsigned full = static_cast<unsigned>(exec.multiprocessors()) * 8;
    const unsigned warp_blocks = std::min(blocks_for(static_cast<std::size_t>(total) * 32, kThreads), full);
    probe<<<warp_blocks, kThreads, 0, exec.stream()>>>(batch);
    check_launch("probe");
    score_leaders<<<blocks_for(static_cast<std::size_t>(count) * kLeaders * 32, kThreads), kThreads, 0, exec.stream()>>>(batch);
    check_launch("score_leaders");
    score_all<<<warp_blocks, kThreads, 0, exec.stream()>>>(batch);
    check_launch("score_all");
    measure_ties<<<warp_blocks, kThreads, 0, exec.stream()>>>(batch, residual.data(), least.data());
    check_launch("measure_ties");
    find_first<<<blocks_for(total, kThreads), kThreads, 0, exec.stream()>>>(batch, residual.data(), least.data(), winner.data());
    check_launch("find_first");
  }
  write_best<<<blocks_for(count, 128), 128, 0, exec.stream()>>>(batch, least.data(), winner.data(), best.data());
  check_launch("write_best");
  return best;
}

}  // namespace gpureg::cuda
