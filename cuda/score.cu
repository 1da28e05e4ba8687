// SPDX-License-Identifier: BSD-3-Clause
#include "entry_of.cuh"
#include "score_batch.cuh"
#include "stages.hpp"

namespace gpureg::cuda {
namespace {

constexpr std::uint32_t kProbeGroups = 4;   // groups of 32 points that tell promising hypotheses from others
constexpr std::uint32_t kLeaders = 16;      // promising hypotheses of a pair that are scored first
constexpr int kProbeThreads = 256;
constexpr std::uint32_t kByBlock = 64;      // hypotheses per multiprocessor up to which each gets a thread block of its own
constexpr int kThreads = 768;
constexpr std::uint32_t kUnroll = 4;        // groups in flight per warp
constexpr std::size_t kRowBytes = 64 * 16;  // of the table of compatible levels
constexpr std::size_t kPointBytes = sizeof(float4) + sizeof(std::uint32_t) + 1;  // and two orders of groups of 32
constexpr std::uint32_t kSharedCodes = 72 << 10;   // bytes of the largest codes that are copied
constexpr std::uint32_t kSharedBlocks = 24 << 10;  // entries of the largest block table that is copied

/// Hypotheses [begin, end) of one pair.
struct Slice {
  std::uint32_t pair, begin, end;
};

/// A point that only its closest target point can decide.
struct Undecided {
  std::uint32_t slot, cell;
};

constexpr std::size_t kWarpBytes = kRowBytes + 64 * sizeof(Undecided);  // of shared memory for each warp

/// What a thread block keeps of a pair while it scores a slice: in shared memory, or where it is too large, in global.
template <typename Block>
struct Staged {
  const float4* point;
  const std::uint32_t* normal;
  const Block* blocks;
  const std::uint8_t* codes;
  const std::uint32_t* by_misses;
  const std::uint32_t* by_refuted;
};

/// Groups [begin, begin + N): how many of this lane's points may be inliers, by the code of their cell. rows: levels that each class of
/// normals needs, in shared memory.
template <std::uint32_t N, typename Block>
__device__ std::uint32_t count_possible(const CellMotion& motion, const Staged<Block>& staged, const std::uint8_t* rows, std::uint32_t begin) {
  const std::uint32_t lane = threadIdx.x % 32;
  float4 p[N];
  std::uint32_t code[N];
#pragma unroll
  for (std::uint32_t k = 0; k < N; ++k) p[k] = staged.point[staged.by_misses[begin + k] * 32u + lane];
#pragma unroll
  for (std::uint32_t k = 0; k < N; ++k) code[k] = motion.locate(p[k], staged.blocks).wide_cell();
#pragma unroll
  for (std::uint32_t k = 0; k < N; ++k) code[k] = staged.codes[code[k]];
  std::uint32_t possible = 0;
#pragma unroll
  for (std::uint32_t k = 0; k < N; ++k) possible += (code[k] & 15u) >= rows[__float_as_uint(p[k].w) + (code[k] >> 4)];
  return possible;
}

/// Exact number of inliers, or 0 as soon as it cannot reach the most seen so far: such a hypothesis is not the best one. First every point
/// is bounded by its cell's code, then by its word, and only undecided ones are looked at. possible: upper bound by words over the groups
/// before `begin`. A warp's work; rows and queue: its own 64 x 16 bytes and 64 entries of shared memory.
template <typename Block>
__device__ std::uint32_t count_inliers(const ScoreBatch& b, const ScorePair& pair, const Limits* limits, const Staged<Block>& staged,
                                       std::uint8_t* rows, Undecided* queue, const Pose<float>& pose, std::uint32_t begin,
                                       std::uint32_t possible, const volatile std::uint32_t* most) {
  const std::uint32_t lane = threadIdx.x % 32;
  const Rigid rigid = to_rigid(pose);
  if (pair.cells.nx == 0) {
    unsigned long long residual;
    return support_by_search(pair, b.test, rigid, residual);
  }
  __syncwarp();
  for (std::uint32_t k = lane; k < 64; k += 32) {
    std::uint8_t row[16];
    compatible_levels(*b.directions, b.thresholds, rigid, k, row);
    std::uint32_t packed[4];
#pragma unroll
    for (int w = 0; w < 4; ++w)
      packed[w] = static_cast<std::uint32_t>(row[4 * w]) | static_cast<std::uint32_t>(row[4 * w + 1]) << 8 |
                  static_cast<std::uint32_t>(row[4 * w + 2]) << 16 | static_cast<std::uint32_t>(row[4 * w + 3]) << 24;
    *reinterpret_cast<uint4*>(rows + k * 16) = make_uint4(packed[0], packed[1], packed[2], packed[3]);
  }
  __syncwarp();
  const CellMotion motion(rigid, pair.cells);
  const std::uint32_t groups = pair.order.groups;
  std::uint32_t needed = *most, g = begin;
  for (; g + kUnroll <= groups; g += kUnroll) {
    if (possible + (groups - g) * 32 < needed) return 0;
    possible += warp_sum(count_possible<kUnroll>(motion, staged, rows, g));
    if (g % 32 < kUnroll) needed = *most;
  }
  for (; g < groups; ++g) possible += warp_sum(count_possible<1>(motion, staged, rows, g));

  // Undecided points wait until there is one for every lane.
  std::uint32_t waiting = 0;
  const auto settle = [&](std::uint32_t count) {
    __syncwarp();
    bool refuted = false;
    if (lane < count) {
      const Undecided u = queue[lane];
      refuted = !is_inlier(pair, b.test, rigid, staged.point[u.slot], staged.normal[u.slot], u.slot, u.cell);
    }
    possible -= static_cast<std::uint32_t>(__popc(static_cast<int>(__ballot_sync(~0u, refuted))));
    __syncwarp();
  };
  for (std::uint32_t k = 0; k < groups; ++k) {
    if (possible < needed) return 0;
    g = staged.by_refuted[k];
    const float4 p = staged.point[g * 32 + lane];
    const CellInBlock cell = motion.locate(p, staged.blocks);
    const std::uint32_t code = staged.codes[cell.wide_cell()];
    // The first groups were bounded by summaries already, not by codes.
    const bool counted = (code & 15u) >= rows[__float_as_uint(p.w) + (code >> 4)] || g < begin;
    if (!__any_sync(~0u, counted)) continue;
    bool refuted = false, undecided = false;
    if (counted) {
      bool certain;
      const bool possible_still = may_be_inlier(rigid, limits, __ldg(pair.cells.word + cell.cell()), staged.normal[g * 32 + lane], certain);
      refuted = !possible_still && g >= begin;
      undecided = possible_still && !certain;
    }
    possible -= static_cast<std::uint32_t>(__popc(static_cast<int>(__ballot_sync(~0u, refuted))));
    const unsigned asked = __ballot_sync(~0u, undecided);
    if (undecided) queue[waiting + static_cast<std::uint32_t>(__popc(static_cast<int>(asked & ((1u << lane) - 1))))] = {g * 32 + lane, cell.cell()};
    waiting += static_cast<std::uint32_t>(__popc(static_cast<int>(asked)));
    if (waiting >= 32) {
      settle(32);
      waiting -= 32;
      const Undecided moved = queue[32 + lane];
      __syncwarp();
      if (lane < waiting) queue[lane] = moved;
      needed = *most;
    }
  }
  if (possible < needed) return 0;
  settle(waiting);
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
  const std::uint32_t total = b.offset[b.pair_count], warps = gridDim.x * (kProbeThreads / 32), lane = threadIdx.x % 32;
  for (std::uint32_t h = (blockIdx.x * kProbeThreads + threadIdx.x) / 32; h < total; h += warps) {
    const std::uint32_t p = entry_of(b.offset, b.pair_count, h);
    const ScorePair& pair = b.pairs[p];
    std::uint32_t possible = 0;
    const bool look = b.valid[h] && pair.cells.nx > 0;
    if (look) {
      const Rigid rigid = to_rigid(b.poses[h]);
      const CellMotion motion(rigid, pair.cells);
      bool certain;
#pragma unroll
      for (std::uint32_t g = 0; g < kProbeGroups; ++g) {
        if (g >= pair.order.groups) break;
        const std::uint32_t cell = motion.locate(__ldg(pair.order.point + g * 32 + lane), pair.cells.block).cell();
        possible += may_be_inlier(rigid, limits + pair.limits * 256, __ldg(pair.cells.word + cell),
                                  __ldg(pair.order.normal + g * 32 + lane), certain);
      }
      possible = warp_sum(possible);
    }
    if (lane != 0) continue;
    b.possible[h] = possible;
    if (!look) continue;
    const std::uint32_t number = h - b.offset[p];
    unsigned long long* leader = b.leaders + static_cast<std::size_t>(p) * kLeaders + number % kLeaders;
    const unsigned long long claim = static_cast<unsigned long long>(possible + 1) << 32 | ~number;
    if (claim > *leader) atomicMax(leader, claim);
  }
}

/// Inliers of one hypothesis by a whole thread block: the paper's way, one block per hypothesis and a parallel reduction. All threads get
/// it. Where asked for, misses are added up per group of points.
__device__ std::uint32_t count_by_block(const ScoreBatch& b, const ScorePair& pair, const Limits* limits, const Pose<float>& pose,
                                        std::uint32_t* misses, std::uint32_t* refuted) {
  __shared__ std::uint32_t inliers;
  __syncthreads();
  if (threadIdx.x == 0) inliers = 0;
  __syncthreads();
  const Rigid rigid = to_rigid(pose);
  std::uint32_t mine = 0;
  if (pair.cells.nx > 0) {
    const CellMotion motion(rigid, pair.cells);
    // A warp takes a group at a time.
    for (std::uint32_t k = threadIdx.x; k < pair.order.groups * 32; k += blockDim.x) {
      const float4 point = __ldg(pair.order.point + k);
      const std::uint32_t cell = motion.locate(point, pair.cells.block).cell(), word = __ldg(pair.cells.word + cell);
      bool possible = false, inlier = false;
      if (word != 0) {
        const std::uint32_t normal = __ldg(pair.order.normal + k);
        bool certain;
        possible = may_be_inlier(rigid, limits, word, normal, certain);
        inlier = possible && (certain || is_inlier(pair, b.test, rigid, point, normal, k, cell));
      }
      mine += inlier;
      if (!misses) continue;
      const unsigned missing = __ballot_sync(~0u, !inlier), late = __ballot_sync(~0u, possible && !inlier);
      if (threadIdx.x % 32 != 0) continue;
      atomicAdd(misses + k / 32, static_cast<std::uint32_t>(__popc(static_cast<int>(missing))));
      atomicAdd(refuted + k / 32, static_cast<std::uint32_t>(__popc(static_cast<int>(late))));
    }
  } else {
    for (std::uint32_t i = threadIdx.x; i < pair.source.size; i += blockDim.x) {
      const Closest found = find_closest(pair.target.closest, pair.target.points, apply(rigid, pair.source.points[i]), b.test.max_squared);
      mine += found.index != kNoValue &&
              normals_agree(rotate(rigid, pair.source.normals[i]), pair.target.normals[found.index], b.test.min_cosine);
    }
  }
  mine = warp_sum(mine);
  if (threadIdx.x % 32 == 0 && mine > 0) atomicAdd(&inliers, mine);
  __syncthreads();
  return inliers;
}

/// What the leaders reach the others must beat.
__global__ void __launch_bounds__(kProbeThreads) score_leaders(ScoreBatch b) {
  __shared__ Limits limits[512];
  const std::uint32_t p = blockIdx.x / kLeaders;
  const unsigned long long leader = b.leaders[blockIdx.x];
  if (leader == 0) return;
  load_limits(b.limits, limits);
  const ScorePair& pair = b.pairs[p];
  const std::uint32_t inliers = count_by_block(b, pair, limits + pair.limits * 256, b.poses[b.offset[p] + ~static_cast<std::uint32_t>(leader)],
                                               b.misses + b.group_offset[p], b.refuted + b.group_offset[p]);
  if (threadIdx.x == 0 && inliers > 0) atomicMax(b.most + p, inliers);
}

/// Orders the groups of each pair by what the leaders say of them: where points fail first, a hypothesis is given up soonest. A thread block
/// per pair counts for each group how many come before it.
__global__ void __launch_bounds__(kProbeThreads) order_groups(ScoreBatch b) {
  const std::uint32_t begin = b.group_offset[blockIdx.x], groups = b.group_offset[blockIdx.x + 1] - begin;
  for (std::uint32_t g = threadIdx.x; g < groups; g += kProbeThreads) {
    const std::uint32_t misses = b.misses[begin + g], refuted = b.refuted[begin + g];
    std::uint32_t before = 0, before_refuted = 0;
    for (std::uint32_t o = 0; o < groups; ++o) {
      const std::uint32_t m = b.misses[begin + o], r = b.refuted[begin + o];
      const bool probed = o < kProbeGroups;
      before += g < kProbeGroups ? o < g : probed || m > misses || (m == misses && o < g);
      before_refuted += r > refuted || (r == refuted && o < g);
    }
    b.by_misses[begin + before] = g;
    b.by_refuted[begin + before_refuted] = g;
  }
}

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
                                                            std::uint32_t block_room, std::uint32_t code_room) {
  extern __shared__ float4 shared_points[];
  std::uint32_t* shared_normals = reinterpret_cast<std::uint32_t*>(shared_points + point_room);
  std::uint32_t* shared_order = shared_normals + point_room;
  std::uint8_t* shared_rows = reinterpret_cast<std::uint8_t*>(shared_order + point_room / 4);
  std::uint8_t* shared_codes = shared_rows + kThreads / 32 * kWarpBytes;
  std::uint16_t* shared_blocks = reinterpret_cast<std::uint16_t*>(shared_codes + code_room);
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
    const std::uint32_t codes = (pair.cells.block_count + 1) * kCodesPerBlock;
    if (points > point_room || blocks > block_room || codes > code_room) {
      score_slice(b, slice, limits, Staged<std::int32_t>{pair.order.point, pair.order.normal, pair.cells.block, pair.cells.code, b.by_misses + first_group,
                                                          b.by_refuted + first_group}, rows, queue, &next);
      continue;
    }
    if (loaded != slice.pair) {
      for (std::uint32_t k = threadIdx.x; k < points; k += kThreads) shared_points[k] = pair.order.point[k], shared_normals[k] = pair.order.normal[k];
      for (std::uint32_t k = threadIdx.x; k < pair.order.groups; k += kThreads)
        shared_order[k] = b.by_misses[first_group + k], shared_order[pair.order.groups + k] = b.by_refuted[first_group + k];
      for (std::uint32_t k = threadIdx.x; k < blocks; k += kThreads) shared_blocks[k] = static_cast<std::uint16_t>(pair.cells.block[k]);
      for (std::uint32_t k = threadIdx.x; k < codes / 16; k += kThreads)
        reinterpret_cast<uint4*>(shared_codes)[k] = reinterpret_cast<const uint4*>(pair.cells.code)[k];
      loaded = slice.pair;
      __syncthreads();
    }
    score_slice(b, slice, limits, Staged<std::uint16_t>{shared_points, shared_normals, shared_blocks, shared_codes,
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
    probe<<<std::min(blocks_for(static_cast<std::size_t>(total) * 32, kProbeThreads), processors * 8), kProbeThreads, 0, exec.stream()>>>(batch);
    check_launch("probe");
    score_leaders<<<count * kLeaders, kProbeThreads, 0, exec.stream()>>>(batch);
    check_launch("score_leaders");
    order_groups<<<count, kProbeThreads, 0, exec.stream()>>>(batch);
    check_launch("order_groups");
    const std::vector<Slice> slices = cut_slices(*hypotheses.segments, processors);
    const auto slices_on_device = exec.upload(slices);
    std::uint32_t most_points = 0, most_blocks = 0, most_codes = 0;
    for (const ScorePair& pair : host_pairs) {
      most_points = std::max(most_points, pair.order.groups * 32);
      most_blocks = std::max(most_blocks, static_cast<std::uint32_t>(pair.cells.nx * pair.cells.ny * pair.cells.nz));
      most_codes = std::max(most_codes, (pair.cells.block_count + 1) * kCodesPerBlock);
    }
    // The table numbers blocks with 16 bits. A pair of which something does not fit is read from global memory.
    const std::uint32_t block_room = std::min(most_blocks, kSharedBlocks), code_room = std::min(most_codes, kSharedCodes);
    const std::size_t fixed = kThreads / 32 * kWarpBytes + block_room * sizeof(std::uint16_t) + code_room + 8192;
    const std::uint32_t point_room =
        std::min(most_points, static_cast<std::uint32_t>(exec.shared_bytes_per_block() > fixed ? (exec.shared_bytes_per_block() - fixed) / kPointBytes / 32 * 32 : 0));
    const std::size_t bytes = point_room * kPointBytes + kThreads / 32 * kWarpBytes + block_room * sizeof(std::uint16_t) + code_room;
    check(cudaFuncSetAttribute(score_slices, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(bytes)), "cudaFuncSetAttribute");
    score_slices<<<std::min(static_cast<unsigned>(slices.size()), processors), kThreads, bytes, exec.stream()>>>(
        batch, slices_on_device.data(), static_cast<std::uint32_t>(slices.size()), point_room, block_room, code_room);
    check_launch("score_slices");
  }
  return select_best(exec, batch, total);
}

}  // namespace gpureg::cuda
