// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/common/stages.hpp"
#include "cuda/device/entry_of.cuh"
#include "cuda/device/launch.cuh"
#include "cuda/quadruples/count_inliers.cuh"

namespace gpureg::cuda {
namespace {

// Hypotheses per multiprocessor up to which each gets a thread block of its own.
constexpr std::uint32_t kByBlock = 64;
constexpr int kThreads = 896;
constexpr std::size_t kPointBytes = sizeof(float2) + sizeof(float) + 1;

/// Hypotheses [begin, end) of one pair.
struct Slice {
  std::uint32_t pair, begin, end;
};

/// A thread block per hypothesis: the fastest way to score a few of them, as no warp iterates over
/// a whole cloud.
__global__ void __launch_bounds__(kProbeThreads) score_by_block(ScoreBatch b) {
  __shared__ Limits limits[512];
  __shared__ std::uint32_t agreeing[64];
  __shared__ std::uint32_t needed;
  load_limits(b.limits, limits);
  const std::uint32_t total = b.offset[b.pair_count];
  for (std::uint32_t h = blockIdx.x; h < total; h += gridDim.x) {
    const std::uint32_t p = entry_of(b.offset, b.pair_count, h);
    const ScorePair& pair = b.pairs[p];
    std::uint32_t inliers = 0;
    if (b.valid[h]) {
      __syncthreads();
      if (threadIdx.x == 0) needed = *static_cast<volatile std::uint32_t*>(b.most + p);
      __syncthreads();
      const std::uint32_t possible = count_possible_by_block(b, pair, b.poses[h], agreeing);
      if (possible >= needed)
        inliers = count_by_block(b, pair, limits + pair.limits * 256, b.poses[h]);
    }
    if (threadIdx.x != 0) continue;
    b.inliers[h] = inliers;
    if (inliers > 0) atomicMax(b.most + p, inliers);
  }
}

/// next, most: of the thread block, in shared memory; most is its copy of the largest number of
/// inliers of the pair.
template <typename Points>
__device__ void score_slice(const ScoreBatch& b, const Slice& slice, const Limits* limits,
                            const Staged<Points>& staged, WarpMemory& memory, std::uint32_t* next,
                            std::uint32_t* most) {
  const std::uint32_t lane = threadIdx.x % 32;
  const ScorePair& pair = b.pairs[slice.pair];
  const LookOrder look = b.look_of(slice.pair);
  for (;;) {
    std::uint32_t h = 0;
    if (lane == 0) h = atomicAdd(next, 1);
    h = __shfl_sync(~0u, h, 0);
    if (h >= slice.end) return;
    if (b.inliers[h] != kNoValue) continue;  // a sample
    std::uint32_t inliers = 0;
    if (b.valid[h])
      inliers = count_inliers(b, pair, limits + pair.limits * 256, staged, memory, b.poses[h], look,
                              most);
    if (lane != 0) continue;
    b.inliers[h] = inliers;
    atomicMax(most, inliers > 0 ? max(inliers, atomicMax(b.most + slice.pair, inliers))
                                : *static_cast<volatile std::uint32_t*>(b.most + slice.pair));
  }
}

/// Thread blocks take slices until none is left, and warps take hypotheses of a slice: the time of
/// one is unpredictable. The points of the source and the target's table of bricks are in shared
/// memory where they fit; the codes stay in the cache.
__global__ void __launch_bounds__(kThreads, 1)
    score_slices(ScoreBatch b, const Slice* slices, std::uint32_t count, std::uint32_t bytes) {
  extern __shared__ float2 shared[];
  __shared__ WarpMemory warps[kThreads / 32];
  __shared__ Limits limits[512];
  __shared__ std::uint32_t taken, next, most;
  load_limits(b.limits, limits);
  WarpMemory& memory = warps[threadIdx.x / 32];
  std::uint32_t loaded = kNoValue;
  for (;;) {
    __syncthreads();
    if (threadIdx.x == 0) {
      taken = atomicAdd(b.next, 1);
      if (taken < count) {
        next = slices[taken].begin;
        most = *static_cast<volatile std::uint32_t*>(b.most + slices[taken].pair);
      }
    }
    __syncthreads();
    if (taken >= count) return;
    const Slice slice = slices[taken];
    const ScorePair& pair = b.pairs[slice.pair];
    const std::uint32_t* order = b.by_misses + b.group_offset[slice.pair];
    const std::uint32_t points = pair.order.groups * 32,
                        runs = pair.cells.nx > 0 ? pair.cells.brick_runs() : 0;
    if (runs == 0 || points * kPointBytes + runs * sizeof(uint2) > bytes) {
      score_slice(
          b, slice, limits,
          Staged<PointsInGlobal>{{pair.order.point, order}, pair.cells.run, pair.cells.brick},
          memory, &next, &most);
      continue;
    }
    uint2* shared_runs = reinterpret_cast<uint2*>(shared + points);
    float* z = reinterpret_cast<float*>(shared_runs + runs);
    std::uint8_t* normal_class = reinterpret_cast<std::uint8_t*>(z + points);
    if (loaded != slice.pair) {
      for (std::uint32_t k = threadIdx.x; k < points; k += kThreads) {
        const float4 p = pair.order.point[order[k / 32] * 32 + k % 32];
        shared[k] = make_float2(p.x, p.y);
        z[k] = p.z;
        normal_class[k] = static_cast<std::uint8_t>(__float_as_uint(p.w));
      }
      for (std::uint32_t k = threadIdx.x; k < runs; k += kThreads)
        shared_runs[k] = pair.cells.run[k];
      loaded = slice.pair;
      __syncthreads();
    }
    score_slice(b, slice, limits,
                Staged<PointsInShared>{{shared, z, normal_class}, shared_runs, pair.cells.brick},
                memory, &next, &most);
  }
}

std::vector<ScorePair> score_pairs(Span<const PairView> pairs,
                                   const RegistrationSettings& options) {
  std::vector<ScorePair> out;
  for (const PairView& pair : pairs) {
    const auto& source = *static_cast<const CudaCloud*>(pair.source.executor_data);
    const auto& target = *static_cast<const CudaCloud*>(pair.target.executor_data);
    // Covered cells refer to the distance that they were built for; for a shorter one they only
    // refute.
    const float built = target.options.max_correspondence_distance;
    const bool exact = built * built == options.prepare.max_correspondence_distance *
                                            options.prepare.max_correspondence_distance;
    out.push_back({pair.source, pair.target, source.order, target.summaries, exact ? 0u : 1u});
  }
  return out;
}

std::vector<Limits> limit_tables(const RegistrationSettings& options) {
  std::vector<Limits> out;
  for (const bool exact : {true, false}) {
    const SummaryLimits limits(options.quadruples.max_normal_angle, exact);
    for (int code = 0; code < 256; ++code)
      out.push_back({limits.none_below[code], limits.all_above[code]});
  }
  return out;
}

/// Cuts slices small enough to keep every multiprocessor busy to the end, and large enough to
/// amortise loading the points.
std::vector<Slice> cut_slices(const Segments& segments, unsigned multiprocessors) {
  // A warp's worth of hypotheses at least; eight slices per multiprocessor even out their times.
  constexpr std::uint32_t kLeast = 32, kMost = 2048, kSlicesEach = 8;
  const std::uint32_t size =
      std::max(kLeast, std::min(kMost, segments.total() / (multiprocessors * kSlicesEach)));
  std::vector<Slice> out;
  for (std::uint32_t p = 0; p < segments.entries(); ++p)
    for (std::uint32_t begin = segments.offset[p]; begin < segments.offset[p + 1]; begin += size)
      out.push_back({p, begin, std::min(begin + size, segments.offset[p + 1])});
  return out;
}

}  // namespace

DeviceBuffer<BestPose> score_hypotheses(Exec& exec, Span<const PairView> pairs,
                                        const Hypotheses& hypotheses,
                                        const RegistrationSettings& options) {
  const std::uint32_t total = hypotheses.segments->total();
  const std::uint32_t count = static_cast<std::uint32_t>(pairs.size);
  const std::vector<ScorePair> host_pairs = score_pairs(pairs, options);
  const auto pairs_on_device = exec.upload(host_pairs);
  const DirectionTables directions = direction_tables();
  const auto directions_on_device = exec.upload(&directions, 1);
  const auto limits = exec.upload(limit_tables(options));
  const auto inliers = exec.filled<std::uint32_t>(total, 0xff);
  const auto leaders =
      exec.filled<unsigned long long>(static_cast<std::size_t>(count) * kLeaders, 0);
  const auto most = exec.filled<std::uint32_t>(count, 0);
  const auto next = exec.filled<std::uint32_t>(1, 0);
  const Segments groups =
      make_segments(exec, count, [&](std::size_t p) { return host_pairs[p].order.groups; });
  const std::size_t slots = std::size_t(groups.total()) * 32;
  const auto misses = exec.filled<std::uint32_t>(groups.total(), 0),
             refuted = exec.filled<std::uint32_t>(slots, 0);
  const auto by_misses = exec.buffer<std::uint32_t>(groups.total()),
             look_index = exec.buffer<std::uint32_t>(slots);
  const auto look_point = exec.buffer<float4>(slots), look_normal = exec.buffer<float4>(slots);
  ScoreBatch batch{};
  batch.pairs = pairs_on_device.data();
  batch.pair_count = count;
  batch.offset = hypotheses.segments->on_device.data();
  batch.poses = hypotheses.pose.data();
  batch.valid = hypotheses.valid.data();
  batch.id = hypotheses.id;
  batch.test =
      inlier_test(options.prepare.max_correspondence_distance, options.quadruples.max_normal_angle);
  batch.limits = limits.data();
  batch.directions = directions_on_device.data();
  batch.code_test = code_test(options.quadruples.max_normal_angle);
  batch.inliers = inliers.data();
  batch.leaders = leaders.data();
  batch.most = most.data();
  batch.next = next.data();
  batch.group_offset = groups.on_device.data();
  batch.misses = misses.data();
  batch.refuted = refuted.data();
  batch.by_misses = by_misses.data();
  batch.look = {look_point.data(), look_normal.data(), look_index.data()};
  if (total > 0) {
    const unsigned processors = static_cast<unsigned>(exec.multiprocessors());
    if (total <= processors * kByBlock) {
      launch(exec, "score_by_block", score_by_block,
             {std::min(total, processors * 8), kProbeThreads}, batch);
      return select_best(exec, batch, total);
    }
    find_leaders(exec, batch);
    score_samples(exec, batch, groups.largest);
    const std::vector<Slice> slices = cut_slices(*hypotheses.segments, processors);
    const auto slices_on_device = exec.upload(slices);
    // The rest of the shared memory serves as cache, which holds the codes.
    const std::size_t room = exec.allow_shared_memory(score_slices);
    std::size_t bytes = 0;
    for (const ScorePair& pair : host_pairs) {
      const std::size_t wanted = std::size_t(pair.order.groups) * 32 * kPointBytes +
                                 pair.cells.brick_runs() * sizeof(uint2);
      if (pair.cells.nx > 0 && wanted <= room) bytes = std::max(bytes, wanted);
    }
    launch(exec, "score_slices", score_slices,
           {std::min(static_cast<unsigned>(slices.size()), processors), kThreads, bytes}, batch,
           slices_on_device.data(), static_cast<std::uint32_t>(slices.size()),
           static_cast<std::uint32_t>(bytes));
  }
  return select_best(exec, batch, total);
}

}  // namespace gpureg::cuda
