// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "score_batch.cuh"

/// How many inliers a hypothesis has: by one warp, which gives up as soon as it is not the best, or by a thread block.
namespace gpureg::cuda {

constexpr std::uint32_t kUnroll = 4;        ///< groups in flight per warp
constexpr std::size_t kRowBytes = 64 * 16;  ///< of the table of compatible levels

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
  for (std::uint32_t k = 0; k < N; ++k) code[k] = motion.locate(p[k], staged.blocks).cell();
#pragma unroll
  for (std::uint32_t k = 0; k < N; ++k) code[k] = __ldg(staged.codes + code[k]);
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
    std::uint32_t inliers;
    support_by_search(pair, b.test, rigid, lane, 32, inliers);
    return warp_sum(inliers);
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
    const std::uint32_t code = __ldg(staged.codes + cell.cell());
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

/// Inliers of one hypothesis by a whole thread block: the paper's way, one block per hypothesis and a parallel reduction. All threads get
/// it. Where asked for, misses are added up per group of points.
__device__ inline std::uint32_t count_by_block(const ScoreBatch& b, const ScorePair& pair, const Limits* limits, const Pose<float>& pose,
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
    support_by_search(pair, b.test, rigid, threadIdx.x, blockDim.x, mine);
  }
  mine = warp_sum(mine);
  if (threadIdx.x % 32 == 0 && mine > 0) atomicAdd(&inliers, mine);
  __syncthreads();
  return inliers;
}

}  // namespace gpureg::cuda
