// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/bricks.cuh"
#include "cuda/quadruples/score_batch.cuh"

/// Counts the inliers of a hypothesis: by one warp, which stops once the hypothesis cannot be the
/// best, or by a thread block.
namespace gpureg::cuda {

constexpr std::uint32_t kUnroll = 4;  ///< groups in flight per warp

/// Points of the source in groups of 32 in shared memory; groups at which hypotheses fail come
/// first.
struct PointsInShared {
  const float2* xy;
  const float* z;
  const std::uint8_t* normal_class;
  __device__ float4 operator()(std::uint32_t group, std::uint32_t lane) const {
    const std::uint32_t k = group * 32 + lane;
    const float2 p = xy[k];
    return make_float4(p.x, p.y, z[k], __uint_as_float(normal_class[k]));
  }
};

/// The same in global memory, for clouds that exceed shared memory.
struct PointsInGlobal {
  const float4* point;
  const std::uint32_t* order;
  __device__ float4 operator()(std::uint32_t group, std::uint32_t lane) const {
    return __ldg(point + __ldg(order + group) * 32 + lane);
  }
};

/// Data shared by the hypotheses of a slice.
template <typename Points>
struct Staged {
  Points points;
  const uint2* runs;
  const std::uint32_t* bricks;
};

/// Shared memory of a warp.
struct WarpMemory {
  std::uint32_t agreeing[64];  ///< codes that agree with each class of normals
  alignas(16) Rigid rigid;     ///< the hypothesis
  alignas(16) BrickMotion motion;
};

/// Groups [begin, begin + N): number of points of this lane that may be inliers, by the code of
/// their cell.
template <std::uint32_t N, typename Points>
__device__ std::uint32_t count_possible(const BrickMotion& motion, const Staged<Points>& staged,
                                        const WarpMemory& memory, std::uint32_t begin) {
  float4 p[N];
  BrickCell cell[N];
  std::uint32_t word[N] = {};
#pragma unroll
  for (std::uint32_t k = 0; k < N; ++k) p[k] = staged.points(begin + k, threadIdx.x % 32);
#pragma unroll
  for (std::uint32_t k = 0; k < N; ++k) {
    cell[k] = motion.locate(p[k]);
    const BrickWord at = motion.find(cell[k], staged.runs);
    if (at.there) word[k] = staged.bricks[at.number];
  }
  std::uint32_t possible = 0;
#pragma unroll
  for (std::uint32_t k = 0; k < N; ++k)
    possible += code_agrees(word[k], cell[k], memory.agreeing[__float_as_uint(p[k].w)]);
  return possible;
}

/// An undecided point and the summary of its cell.
struct Look {
  float4 point, normal;
  uint2 cell;    ///< summary and list
  uint2 block;   ///< lists of its block
  bool counted;  ///< already, by the code of its cell
  __device__ bool has_normal() const { return normal.w != 0.0f; }
};

/// Requests the summary of the cell of a loaded point.
template <typename Points>
__device__ void finish_look(const ScorePair& pair, const Staged<Points>& staged,
                            const WarpMemory& memory, Look& look) {
  const BrickCell cell = memory.motion.locate(look.point);
  const BrickWord word = memory.motion.find(cell, staged.runs);
  look.counted = word.there && code_agrees(staged.bricks[word.number], cell,
                                           memory.agreeing[__float_as_uint(look.point.w)]);
  look.cell = look.block = {};
  if (!look.counted) return;
  look.cell = __ldg(pair.cells.cell + cell_in_bricks(word, cell));
  look.block = __ldg(pair.cells.block + word.number / 16);
}

template <typename Points>
__device__ Look begin_look(const ScorePair& pair, const Staged<Points>& staged,
                           const WarpMemory& memory, const LookOrder& order, std::uint32_t k) {
  Look look;
  look.point = __ldg(order.point + k);
  look.normal = __ldg(order.normal + k);
  finish_look(pair, staged, memory, look);
  return look;
}

/// A number that other warps raise meanwhile: all lanes get the value that lane 0 reads. Lanes that
/// read it one after another could see different values and part before the next full-warp step.
__device__ inline std::uint32_t read_by_warp(const volatile std::uint32_t* number) {
  return __shfl_sync(~0u, *number, 0);
}

/// Exact number of inliers, or 0 as soon as it cannot reach the largest number so far; such a
/// hypothesis is not the best one. By one warp. The codes of the cells bound every point first.
/// Possible inliers are then tested in the order of how often they refute hypotheses, by the
/// summary of their cell and then by their closest point.
template <typename Points>
__device__ std::uint32_t count_inliers(const ScoreBatch& b, const ScorePair& pair,
                                       const Limits* limits, const Staged<Points>& staged,
                                       WarpMemory& memory, const Pose<float>& pose,
                                       const LookOrder& look, const volatile std::uint32_t* most) {
  const std::uint32_t lane = threadIdx.x % 32;
  const Rigid rigid = to_rigid(pose);
  if (pair.cells.nx == 0) {
    std::uint32_t inliers;
    support_by_search(pair, b.test, rigid, lane, 32, inliers);
    return warp_sum(inliers);
  }
  __syncwarp();
  for (std::uint32_t k = lane; k < 64; k += 32)
    memory.agreeing[k] = agreeing_codes(*b.directions, b.code_test, rigid, k);
  __syncwarp();
  const BrickMotion motion(rigid, pair.cells);
  if (lane == 0) {
    memory.rigid = rigid;
    memory.motion = motion;
  }
  __syncwarp();
  const std::uint32_t groups = pair.order.groups;
  std::uint32_t needed = read_by_warp(most), possible = 0, g = 0;
  for (; g + kUnroll <= groups; g += kUnroll) {
    if (possible + (groups - g) * 32 < needed) return 0;
    possible += warp_sum(count_possible<kUnroll>(motion, staged, memory, g));
    if (g % 32 < kUnroll) needed = read_by_warp(most);
  }
  for (; g < groups; ++g) possible += warp_sum(count_possible<1>(motion, staged, memory, g));

  // Loads the next points while these are decided.
  const std::uint32_t end = groups * 32;
  Look next = begin_look(pair, staged, memory, look, lane);
  for (std::uint32_t k = lane; k < end; k += 32) {
    if (possible < needed) return 0;
    const Look now = next;
    if (k + 32 < end) {
      next.point = __ldg(look.point + k + 32);
      next.normal = __ldg(look.normal + k + 32);
    }
    bool refuted = false;
    if (now.counted) {
      const Vec3 moved_normal = rotate_fast(memory.rigid, now.normal);
      bool certain;
      refuted = !may_be_inlier(limits, now.cell.x, moved_normal, now.has_normal(), certain);
      if (!refuted && !certain) {
        const Vec3 q = apply(memory.rigid, {now.point.x, now.point.y, now.point.z});
        refuted = !agrees_with(pair, b.test, memory.rigid, moved_normal, now.has_normal(),
                               kHalfPackedCosineError, look.index + k,
                               closest_in_list(pair.cells, now.block, now.cell.y, q));
      }
    }
    if (k + 32 < end) finish_look(pair, staged, memory, next);
    __syncwarp();
    possible -= static_cast<std::uint32_t>(__popc(static_cast<int>(__ballot_sync(~0u, refuted))));
    needed = read_by_warp(most);
  }
  return possible < needed ? 0 : possible;
}

/// Number of possible inliers by the codes of their cells, by a thread block; all threads get it.
/// agreeing: 64 words of shared memory.
__device__ inline std::uint32_t count_possible_by_block(const ScoreBatch& b, const ScorePair& pair,
                                                        const Pose<float>& pose,
                                                        std::uint32_t* agreeing) {
  __shared__ std::uint32_t possible;
  if (pair.cells.nx == 0) return pair.source.size;
  const Rigid rigid = to_rigid(pose);
  __syncthreads();
  if (threadIdx.x == 0) possible = 0;
  for (std::uint32_t k = threadIdx.x; k < 64; k += blockDim.x)
    agreeing[k] = agreeing_codes(*b.directions, b.code_test, rigid, k);
  __syncthreads();
  const BrickMotion motion(rigid, pair.cells);
  const std::uint32_t points = pair.order.groups * 32;
  std::uint32_t mine = 0;
#pragma unroll 4
  for (std::uint32_t k = threadIdx.x; k < points; k += blockDim.x) {
    const float4 point = __ldg(pair.order.point + k);
    const BrickCell cell = motion.locate(point);
    const BrickWord word = motion.find(cell, pair.cells.run);
    mine += word.there && code_agrees(__ldg(pair.cells.brick + word.number), cell,
                                      agreeing[__float_as_uint(point.w)]);
  }
  mine = warp_sum(mine);
  if (threadIdx.x % 32 == 0 && mine > 0) atomicAdd(&possible, mine);
  __syncthreads();
  return possible;
}

/// Exact number of inliers by a thread block, as in LoopSmart: one block per hypothesis and a
/// parallel reduction. All threads get it.
__device__ inline std::uint32_t count_by_block(const ScoreBatch& b, const ScorePair& pair,
                                               const Limits* limits, const Pose<float>& pose) {
  __shared__ std::uint32_t inliers;
  __syncthreads();
  if (threadIdx.x == 0) inliers = 0;
  __syncthreads();
  const Rigid rigid = to_rigid(pose);
  std::uint32_t mine = 0;
  if (pair.cells.nx > 0) {
    const BrickMotion motion(rigid, pair.cells);
    // A warp takes a group at a time.
    for (std::uint32_t k = threadIdx.x; k < pair.order.groups * 32; k += blockDim.x) {
      const float4 point = __ldg(pair.order.point + k);
      const BrickCell cell = motion.locate(point);
      const BrickWord word = motion.find(cell, pair.cells.run);
      if (!word.there) continue;
      const std::uint32_t summary = __ldg(&pair.cells.cell[cell_in_bricks(word, cell)].x);
      const std::uint32_t normal = __ldg(pair.order.normal + k);
      bool certain;
      const bool possible = may_be_inlier(rigid, limits, summary, normal, certain);
      mine += possible && (certain || is_inlier(pair, b.test, rigid, point, normal,
                                                pair.order.index + k, word, cell));
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
