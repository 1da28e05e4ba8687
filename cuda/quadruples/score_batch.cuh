// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/closest_cells.cuh"
#include "cuda/device/warp.cuh"
#include "cuda/prepare/directions.hpp"
#include "cuda/quadruples/bounds.cuh"

namespace gpureg::cuda {

/// Groups of 32 points that rank hypotheses for the choice of leaders.
constexpr std::uint32_t kProbeGroups = 4;
/// Leaders of a pair: likely hypotheses, scored first.
constexpr std::uint32_t kLeaders = 32;
constexpr int kProbeThreads = 256;

/// Points with the class of their normal, normals (w: 0 without one), and their indices in the
/// cloud.
struct LookOrder {
  float4* point;
  float4* normal;
  std::uint32_t* index;
};

/// Arguments of the scoring kernels.
struct ScoreBatch {
  const ScorePair* pairs;
  std::uint32_t pair_count;
  const std::uint32_t* offset;  ///< of the pairs' hypotheses
  const Pose<float>* poses;
  const std::uint8_t* valid;
  const std::uint32_t* id;
  InlierTest test;
  const Limits* limits;  ///< 2 x 256
  const DirectionTables* directions;
  CodeTest code_test;
  /// per hypothesis; kNoValue before it is scored, 0 where it was abandoned
  std::uint32_t* inliers;
  /// pairs x kLeaders: (possible + 1, ~number), the largest of each residue class; 0: none
  unsigned long long* leaders;
  std::uint32_t* most;  ///< per pair: inliers of the best so far
  std::uint32_t* next;  ///< number of slices taken
  /// per pair: offset into the arrays by group, and 1/32 of that into the arrays by point
  const std::uint32_t* group_offset;
  /// per group: points without a partner under the samples, by the codes
  std::uint32_t* misses;
  /// per point of the scoring order: how often its code passes although it is no inlier
  std::uint32_t* refuted;
  std::uint32_t* by_misses;  ///< groups of a pair, those with the most misses first
  LookOrder look;            ///< points of a pair, the most often refuted first

  __device__ LookOrder look_of(std::uint32_t pair) const {
    const std::size_t at = std::size_t(group_offset[pair]) * 32;
    return {look.point + at, look.normal + at, look.index + at};
  }
};

/// Loads both tables into shared memory, by all threads of the block.
__device__ inline void load_limits(const Limits* from, Limits* to) {
  for (unsigned k = threadIdx.x; k < 512; k += blockDim.x) to[k] = from[k];
  __syncthreads();
}

/// Searches every `step`th point of one pose from the first on: number of inliers, and the sum of
/// their residuals.
__device__ inline unsigned long long support_by_search(const ScorePair& pair,
                                                       const InlierTest& test, const Rigid& rigid,
                                                       std::uint32_t first, std::uint32_t step,
                                                       std::uint32_t& inliers) {
  inliers = 0;
  unsigned long long residual = 0;
  for (std::uint32_t i = first; i < pair.source.size; i += step) {
    const Closest found = find_closest(pair.target, pair.cells, apply(rigid, pair.source.points[i]),
                                       test.max_squared);
    if (found.index == kNoValue) continue;
    if (!normals_agree(rotate(rigid, pair.source.normals[i]), pair.target.normals[found.index],
                       test.min_cosine))
      continue;
    ++inliers;
    residual += fixed_residual(found.squared_distance, test.inverse_max_squared);
  }
  return residual;
}

/// Finds the leaders of each pair: likely hypotheses.
void find_leaders(Exec& exec, const ScoreBatch& batch);

/// Scores the leaders and some other hypotheses of each pair, and derives the order of the points
/// from them. Their largest number of inliers is the bound for the other hypotheses.
void score_samples(Exec& exec, const ScoreBatch& batch, std::uint32_t most_groups);

/// Selects among the hypotheses with the most inliers of their pair: smallest residual, then lowest
/// index.
DeviceBuffer<BestPose> select_best(Exec& exec, const ScoreBatch& batch, std::uint32_t total);

}  // namespace gpureg::cuda
