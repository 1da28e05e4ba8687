// SPDX-License-Identifier: BSD-3-Clause
#include "count_inliers.cuh"
#include "entry_of.cuh"
#include "stages.hpp"

namespace gpureg::cuda {
namespace {

constexpr std::uint32_t kByBlock = 64;  // hypotheses per multiprocessor up to which each gets a thread block of its own
constexpr int kThreads = 1024;
constexpr std::size_t kPointBytes = sizeof(float4) + sizeof(std::uint32_t) + 1;  // and two orders of groups of 32
constexpr std::uint32_t kSharedBlocks = 24 << 10;  // entries of the largest block table that is copied

/// Hypotheses [begin, end) of one pair.
struct Slice {
  std::uint32_t pair, begin, end;
};

/// A thread block per hypothesis: the shortest way through a few of them, as no warp walks over a whole cloud.
__global__ void __launch_bounds__(kProbeThreads) score_by_block(ScoreBatch b) {
  __shared__ Limits limits[512];
  load_limits(b.limits, limits);
  const std::uint32_t total = b.offset[b.pair_count];
  for (std::uint32_t h = blockIdx.x; h < total; h += gridDim.x) {
    const std::uint32_t p = entry_of(b.offset, b.pair_count, h);
    const ScorePair& pair = b.pairs[p];
    const std::uint32_t inliers = b.valid[h] ? count_by_block(b, pair, limits + pair.limits * 256, b.poses[h], nullptr, nullptr) : 0;
    if (threadIdx.x != 0) continue;
    b.inliers[h] = inliers;
    if (inliers > 0) atomicMax(b.most + p, inliers);
  }
}

template <typename Block>
__device__ void score_slice(const ScoreBatch& b, const Slice& slice, const Limits* limits, const Staged<Block>& staged, std::uint8_t* rows,
                            Undecided* queue, std::uint32_t* next) {
  const std::uint32_t lane = threadIdx.x % 32;
  const ScorePair& pair = b.pairs[slice.pair];
  for (;;) {
    std::uint32_t h = 0;
    if (lane == 0) h = atomicAdd(next, 1);
    h = __shfl_sync(~0u, h, 0);
    if (h >= slice.end) return;
    std::uint32_t inliers = 0;
    if (b.valid[h]) {
      inliers = count_inliers(b, pair, limits + pair.limits * 256, staged, rows, queue, b.poses[h], min(kProbeGroups, pair.order.groups),
                              b.possible[h], b.most + slice.pair);
      if (lane == 0 && inliers > 0) atomicMax(b.most + slice.pair, inliers);
    }
    if (lane == 0) b.inliers[h] = inliers;
  }
}

/// Thread blocks take slices until none is left; in a slice the warps take hypotheses: how long one takes is not known before. The source's
/// points and the target's block table are in shared memory, so that the cache is left to the target's cells.
__global__ void __launch_bounds__(kThreads, 1) score_slices(ScoreBatch b, const Slice* slices, std::uint32_t count, std::uint32_t point_room,
                                                            std::uint32_t block_room) {
  extern __shared__ float4 shared_points[];
  std::uint32_t* shared_normals = reinterpret_cast<std::uint32_t*>(shared_points + point_room);
  std::uint32_t* shared_order = shared_normals + point_room;
  std::uint8_t* shared_rows = reinterpret_cast<std::uint8_t*>(shared_order + point_room / 4);
  std::uint16_t* shared_blocks = reinterpret_cast<std::uint16_t*>(shared_rows + kThreads / 32 * kWarpBytes);
  __shared__ Limits limits[512];
  __shared__ std::uint32_t taken, next;
  load_limits(b.limits, limits);
  std::uint8_t* rows = shared_rows + threadIdx.x / 32 * kWarpBytes;
  Undecided* queue = reinterpret_cast<Undecided*>(rows + kRowBytes);
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
    const ScorePair& pair = b.pairs[slice.pair];
    const std::uint32_t points = pair.order.groups * 32;
    const std::uint32_t blocks = static_cast<std::uint32_t>(pair.cells.nx * pair.cells.ny * pair.cells.nz);
    const std::uint32_t first_group = b.group_offset[slice.pair];
    if (points > point_room || blocks > block_room) {
      score_slice(b, slice, limits, Staged<std::int32_t>{pair.order.point, pair.order.normal, pair.cells.block, pair.cells.code, b.by_misses + first_group,
                                                          b.by_refuted + first_group}, rows, queue, &next);
      continue;
    }
    if (loaded != slice.pair) {
      for (std::uint32_t k = threadIdx.x; k < points; k += kThreads) shared_points[k] = pair.order.point[k], shared_normals[k] = pair.order.normal[k];
      for (std::uint32_t k = threadIdx.x; k < pair.order.groups; k += kThreads)
        shared_order[k] = b.by_misses[first_group + k], shared_order[pair.order.groups + k] = b.by_refuted[first_group + k];
      for (std::uint32_t k = threadIdx.x; k < blocks; k += kThreads) shared_blocks[k] = static_cast<std::uint16_t>(pair.cells.block[k]);
      loaded = slice.pair;
      __syncthreads();
    }
    score_slice(b, slice, limits, Staged<std::uint16_t>{shared_points, shared_normals, shared_blocks, pair.cells.code,
                                                 shared_order, shared_order + pair.order.groups}, rows, queue, &next);
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
  const std::vector<ScorePair> host_pairs = score_pairs(pairs, options);
  const auto pairs_on_device = exec.upload(host_pairs);
  const DirectionTables directions = direction_tables();
  const auto directions_on_device = exec.upload(&directions, 1);
  const auto limits = exec.upload(limit_tables(options));
  const auto possible = exec.buffer<std::uint32_t>(total);
  const auto inliers = exec.buffer<std::uint32_t>(total);
  const auto leaders = exec.filled<unsigned long long>(static_cast<std::size_t>(count) * kLeaders, 0);
  const auto most = exec.filled<std::uint32_t>(count, 0);
  const auto next = exec.filled<std::uint32_t>(1, 0);
  const Segments groups = make_segments(exec, count, [&](std::size_t p) { return host_pairs[p].order.groups; });
  const auto misses = exec.filled<std::uint32_t>(groups.total(), 0), refuted = exec.filled<std::uint32_t>(groups.total(), 0);
  const auto by_misses = exec.buffer<std::uint32_t>(groups.total()), by_refuted = exec.buffer<std::uint32_t>(groups.total());
  const ScoreBatch batch{pairs_on_device.data(), count, hypotheses.segments->on_device.data(), hypotheses.pose.data(), hypotheses.valid.data(),
                         hypotheses.id, inlier_test(options.max_correspondence_distance, options.max_normal_angle), limits.data(),
                         directions_on_device.data(), level_thresholds(options.max_normal_angle), possible.data(), inliers.data(), leaders.data(), most.data(), next.data(), groups.on_device.data(), misses.data(), refuted.data(), by_misses.data(),
                         by_refuted.data()};
  if (total > 0) {
    const unsigned processors = static_cast<unsigned>(exec.multiprocessors());
    if (total <= processors * kByBlock) {
      score_by_block<<<std::min(total, processors * 8), kProbeThreads, 0, exec.stream()>>>(batch);
      check_launch("score_by_block");
      return select_best(exec, batch, total);
    }
    score_leaders(exec, batch, total);
    const std::vector<Slice> slices = cut_slices(*hypotheses.segments, processors);
    const auto slices_on_device = exec.upload(slices);
    std::uint32_t most_points = 0, most_blocks = 0;
    for (const ScorePair& pair : host_pairs) {
      most_points = std::max(most_points, pair.order.groups * 32);
      most_blocks = std::max(most_blocks, static_cast<std::uint32_t>(pair.cells.nx * pair.cells.ny * pair.cells.nz));
    }
    // The table numbers blocks with 16 bits. A pair of which something does not fit is read from global memory.
    const std::uint32_t block_room = std::min(most_blocks, kSharedBlocks);
    const std::size_t fixed = kThreads / 32 * kWarpBytes + block_room * sizeof(std::uint16_t) + 8192;
    const std::uint32_t point_room =
        std::min(most_points, static_cast<std::uint32_t>(exec.shared_bytes_per_block() > fixed ? (exec.shared_bytes_per_block() - fixed) / kPointBytes / 32 * 32 : 0));
    const std::size_t bytes = point_room * kPointBytes + kThreads / 32 * kWarpBytes + block_room * sizeof(std::uint16_t);
    check(cudaFuncSetAttribute(score_slices, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(bytes)), "cudaFuncSetAttribute");
    score_slices<<<std::min(static_cast<unsigned>(slices.size()), processors), kThreads, bytes, exec.stream()>>>(
        batch, slices_on_device.data(), static_cast<std::uint32_t>(slices.size()), point_room, block_room);
    check_launch("score_slices");
  }
  return select_best(exec, batch, total);
}

}  // namespace gpureg::cuda
