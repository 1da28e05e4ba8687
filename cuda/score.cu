// SPDX-License-Identifier: BSD-3-Clause
#include "entry_of.cuh"
#include "score_batch.cuh"
#include "stages.hpp"

namespace gpureg::cuda {
namespace {

constexpr std::uint32_t kProbeGroups = 4;   // groups of 32 points that tell promising hypotheses from others
constexpr std::uint32_t kLeaders = 16;      // promising hypotheses of a pair that are scored first
constexpr int kProbeThreads = 256;
constexpr int kThreads = 768;               // as many as 80 registers each allow
constexpr int kUnroll = 4;                  // groups in flight per warp

/// Hypotheses [begin, end) of one pair.
struct Slice {
  std::uint32_t pair, begin, end;
};

/// Source points in shared memory, or in global where they are too many.
template <bool kShared>
struct Points {
  const float4* point;
  const std::uint16_t* normal_z;
  __device__ PackedPoint operator[](std::uint32_t k) const {
    if (kShared) return {point[k], normal_z[k]};
    return {__ldg(point + k), __ldg(normal_z + k)};
  }
};

/// Groups [begin, begin + N): how many of this lane's points may be inliers.
template <int N, bool kShared>
__device__ std::uint32_t count_possible(const CellMotion& motion, const Limits* limits, const Points<kShared>& points, std::uint32_t begin) {
  const std::uint32_t lane = threadIdx.x % 32;
  PackedPoint p[N];
  std::uint32_t word[N];
#pragma unroll
  for (int k = 0; k < N; ++k) p[k] = points[(begin + static_cast<std::uint32_t>(k)) * 32 + lane];
#pragma unroll
  for (int k = 0; k < N; ++k) word[k] = motion.locate(p[k].point);
#pragma unroll
  for (int k = 0; k < N; ++k) word[k] = __ldg(motion.word + word[k]);
  std::uint32_t possible = 0;
#pragma unroll
  for (int k = 0; k < N; ++k) possible += word[k] != 0 && motion.cosine(p[k], word[k]) >= limits[word[k] >> 24].none_below;
  return possible;
}

/// Exact number of inliers, or 0 as soon as it cannot reach the most seen so far: such a hypothesis is not the best one. possible: upper
/// bound over the groups before `begin`.
template <bool kShared>
__device__ std::uint32_t count_inliers(const ScorePair& pair, const InlierTest& test, const Limits* limits, const Points<kShared>& points,
                                       const Pose<float>& pose, std::uint32_t begin, std::uint32_t possible,
                                       const volatile std::uint32_t* most) {
  const std::uint32_t lane = threadIdx.x % 32;
  const Rigid rigid = to_rigid(pose);
  if (pair.cells.nx == 0) {
    unsigned long long residual;
    return support_by_search(pair, test, rigid, residual);
  }
  const CellMotion motion(rigid, pair.cells);
  const std::uint32_t groups = pair.order.groups;
  std::uint32_t needed = *most, g = begin;
  for (; g + kUnroll <= groups; g += kUnroll) {
    if (possible + (groups - g) * 32 < needed) return 0;
    possible += warp_sum(count_possible<kUnroll>(motion, limits, points, g));
    if (g % 32 < kUnroll) needed = *most;
  }
  for (; g < groups; ++g) possible += warp_sum(count_possible<1>(motion, limits, points, g));
  for (g = 0; g < groups; ++g) {
    if (possible < needed) return 0;
    const PackedPoint p = points[g * 32 + lane];
    const std::uint32_t cell = motion.locate(p.point), word = __ldg(motion.word + cell);
    const Limits limit = limits[word >> 24];
    const float cosine = motion.cosine(p, word);
    const bool undecided = word != 0 && cosine >= limit.none_below && cosine < limit.all_above;
    if (!__any_sync(~0u, undecided)) continue;
    const bool refuted = undecided && !is_inlier(pair, test, rigid, __ldg(pair.order.index + g * 32 + lane), cell);
    possible -= static_cast<std::uint32_t>(__popc(static_cast<int>(__ballot_sync(~0u, refuted))));
    if (g % 16 == 15) needed = *most;
  }
  return possible;
}

__device__ void load_limits(const Limits* from, Limits* to) {
  for (unsigned k = threadIdx.x; k < 512; k += blockDim.x) to[k] = from[k];
  __syncthreads();
}

/// A warp per hypothesis looks at a few groups and proposes it as one of its pair's leaders.
__global__ void __launch_bounds__(kProbeThreads) probe(ScoreBatch b) {
  __shared__ Limits limits[512];
  load_limits(b.limits, limits);
  const std::uint32_t total = b.offset[b.pair_count], warps = gridDim.x * (kProbeThreads / 32);
  for (std::uint32_t h = (blockIdx.x * kProbeThreads + threadIdx.x) / 32; h < total; h += warps) {
    const std::uint32_t p = entry_of(b.offset, b.pair_count, h);
    const ScorePair& pair = b.pairs[p];
    std::uint32_t possible = 0;
    const bool look = b.valid[h] && pair.cells.nx > 0;
    if (look) {
      const CellMotion motion(to_rigid(b.poses[h]), pair.cells);
      const Points<false> points{pair.order.point, pair.order.normal_z};
      const Limits* limit = limits + pair.limits * 256;
      if (pair.order.groups >= kProbeGroups) {
        possible = warp_sum(count_possible<kProbeGroups>(motion, limit, points, 0));
      } else {
        for (std::uint32_t g = 0; g < pair.order.groups; ++g) possible += warp_sum(count_possible<1>(motion, limit, points, g));
      }
    }
    if (threadIdx.x % 32 != 0) continue;
    b.possible[h] = possible;
    if (!look) continue;
    const std::uint32_t number = h - b.offset[p];
    unsigned long long* leader = b.leaders + static_cast<std::size_t>(p) * kLeaders + number % kLeaders;
    const unsigned long long claim = static_cast<unsigned long long>(possible + 1) << 32 | ~number;
    if (claim > *leader) atomicMax(leader, claim);
  }
}

/// A thread block per leader counts its inliers: what the others must beat.
__global__ void __launch_bounds__(kProbeThreads) score_leaders(ScoreBatch b) {
  __shared__ std::uint32_t inliers;
  const std::uint32_t p = blockIdx.x / kLeaders;
  const unsigned long long leader = b.leaders[blockIdx.x];
  if (leader == 0) return;
  if (threadIdx.x == 0) inliers = 0;
  __syncthreads();
  const ScorePair& pair = b.pairs[p];
  const Rigid rigid = to_rigid(b.poses[b.offset[p] + ~static_cast<std::uint32_t>(leader)]);
  const CellMotion motion(rigid, pair.cells);
  std::uint32_t mine = 0;
  for (std::uint32_t k = threadIdx.x; k < pair.order.groups * 32; k += kProbeThreads) {
    const std::uint32_t cell = motion.locate(__ldg(pair.order.point + k));
    mine += __ldg(motion.word + cell) != 0 && is_inlier(pair, b.test, rigid, __ldg(pair.order.index + k), cell);
  }
  mine = warp_sum(mine);
  if (threadIdx.x % 32 == 0) atomicAdd(&inliers, mine);
  __syncthreads();
  if (threadIdx.x == 0 && inliers > 0) atomicMax(b.most + p, inliers);
}

template <bool kShared>
__device__ void score_slice(const ScoreBatch& b, const Slice& slice, const Limits* limits, const Points<kShared>& points, std::uint32_t* next) {
  const std::uint32_t lane = threadIdx.x % 32;
  const ScorePair& pair = b.pairs[slice.pair];
  for (;;) {
    std::uint32_t h = 0;
    if (lane == 0) h = atomicAdd(next, 1);
    h = __shfl_sync(~0u, h, 0);
    if (h >= slice.end) return;
    std::uint32_t inliers = 0;
    if (b.valid[h]) {
      inliers = count_inliers<kShared>(pair, b.test, limits + pair.limits * 256, points, b.poses[h], min(kProbeGroups, pair.order.groups),
                                       b.possible[h], b.most + slice.pair);
      if (lane == 0 && inliers > 0) atomicMax(b.most + slice.pair, inliers);
    }
    if (lane == 0) b.inliers[h] = inliers;
  }
}

/// Thread blocks take slices until none is left; in a slice the warps take hypotheses: how long one takes is not known before. The
/// source's points are in shared memory, so that the cache is left to the target's cells.
__global__ void __launch_bounds__(kThreads, 1) score_slices(ScoreBatch b, const Slice* slices, std::uint32_t count, std::uint32_t capacity) {
  extern __shared__ float4 shared_points[];
  std::uint16_t* shared_z = reinterpret_cast<std::uint16_t*>(shared_points + capacity);
  __shared__ Limits limits[512];
  __shared__ std::uint32_t taken, next;
  load_limits(b.limits, limits);
  std::uint32_t loaded = kNoValue;
  for (;;) {
    __syncthreads();
    if (threadIdx.x == 0) {
      taken = atomicAdd(b.next, 1);
      if (taken < count) next = slices[taken].begin;
    }
    __syncthreads();
    if (taken >= count) return;
    const Slice slice = slices[taken];
    const ScoringOrder& order = b.pairs[slice.pair].order;
    if (order.groups * 32 > capacity) {
      score_slice(b, slice, limits, Points<false>{order.point, order.normal_z}, &next);
      continue;
    }
    if (loaded != slice.pair) {
      for (std::uint32_t k = threadIdx.x; k < order.groups * 32; k += kThreads) shared_points[k] = order.point[k], shared_z[k] = order.normal_z[k];
      loaded = slice.pair;
      __syncthreads();
    }
    score_slice(b, slice, limits, Points<true>{shared_points, shared_z}, &next);
  }
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

/// Slices small enough to keep every multiprocessor busy to the end, large enough to be worth loading the points.
std::vector<Slice> cut_slices(const Segments& segments, unsigned multiprocessors) {
  const std::uint32_t size = std::max(32u, std::min(2048u, segments.total() / (multiprocessors * 8)));
  std::vector<Slice> out;
  for (std::uint32_t p = 0; p < segments.entries(); ++p)
    for (std::uint32_t begin = segments.offset[p]; begin < segments.offset[p + 1]; begin += size)
      out.push_back({p, begin, std::min(begin + size, segments.offset[p + 1])});
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
  const ScoreBatch batch{pairs_on_device.data(), count, hypotheses.segments->on_device.data(), hypotheses.pose.data(), hypotheses.valid.data(),
                         hypotheses.id, inlier_test(options.max_correspondence_distance, options.max_normal_angle), limits.data(),
                         possible.data(), inliers.data(), leaders.data(), most.data(), next.data()};
  if (total > 0) {
    const unsigned processors = static_cast<unsigned>(exec.multiprocessors());
    probe<<<std::min(blocks_for(static_cast<std::size_t>(total) * 32, kProbeThreads), processors * 8), kProbeThreads, 0, exec.stream()>>>(batch);
    check_launch("probe");
    score_leaders<<<count * kLeaders, kProbeThreads, 0, exec.stream()>>>(batch);
    check_launch("score_leaders");

    const std::vector<Slice> slices = cut_slices(*hypotheses.segments, processors);
    const auto slices_on_device = exec.upload(slices);
    std::uint32_t largest = 0;
    for (const PairView& pair : pairs) largest = std::max(largest, (pair.source.size + 31) / 32 * 32);
    constexpr std::size_t kBytesPerPoint = sizeof(float4) + sizeof(std::uint16_t);
    const std::uint32_t fits = static_cast<std::uint32_t>((exec.shared_bytes_per_block() - 8192) / kBytesPerPoint) / 32 * 32;
    const std::uint32_t capacity = std::min(largest, fits);
    const std::size_t bytes = capacity * kBytesPerPoint;
    check(cudaFuncSetAttribute(score_slices, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(bytes)), "cudaFuncSetAttribute");
    score_slices<<<std::min(static_cast<unsigned>(slices.size()), processors), kThreads, bytes, exec.stream()>>>(
        batch, slices_on_device.data(), static_cast<std::uint32_t>(slices.size()), capacity);
    check_launch("score_slices");
  }
  return select_best(exec, batch, total);
}

}  // namespace gpureg::cuda
