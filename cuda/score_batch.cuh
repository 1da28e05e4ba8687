// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "bounds.cuh"
#include "directions.hpp"
#include "warp.cuh"

namespace gpureg::cuda {

constexpr std::uint32_t kProbeGroups = 4;   ///< groups of 32 points that tell promising hypotheses from others
constexpr std::uint32_t kLeaders = 16;      ///< promising hypotheses of a pair that are scored first
constexpr int kProbeThreads = 256;

/// What the kernels of scoring share.
struct ScoreBatch {
  const ScorePair* pairs;
  std::uint32_t pair_count;
  const std::uint32_t* offset;      ///< of the pairs' hypotheses
  const Pose<float>* poses;
  const std::uint8_t* valid;
  const std::uint32_t* id;
  InlierTest test;
  const Limits* limits;             ///< 2 x 256
  const DirectionTables* directions;
  LevelThresholds thresholds;
  std::uint32_t* possible;          ///< per hypothesis: points of the probe that may be inliers
  std::uint32_t* inliers;           ///< per hypothesis; 0 where it was given up
  unsigned long long* leaders;      ///< pairs x kLeaders: (possible + 1, ~number), the largest of each residue class; 0: none
  std::uint32_t* most;              ///< per pair: inliers of the best so far
  std::uint32_t* next;              ///< slices handed out
  const std::uint32_t* group_offset;  ///< per pair, of the arrays by group
  std::uint32_t* misses;            ///< per group: points that the leaders' poses leave without a partner
  std::uint32_t* refuted;           ///< per group: of those, the ones that look like inliers until their closest point is found
  std::uint32_t* by_misses;         ///< groups of a pair, those with the most misses first, but the probe's before all
  std::uint32_t* by_refuted;        ///< the same by refuted points
};

/// Both tables into shared memory, by all threads of the block.
__device__ inline void load_limits(const Limits* from, Limits* to) {
  for (unsigned k = threadIdx.x; k < 512; k += blockDim.x) to[k] = from[k];
  __syncthreads();
}

/// Looks up every `step`th point of one pose from the first: how many are inliers, and the sum of their residuals.
__device__ inline unsigned long long support_by_search(const ScorePair& pair, const InlierTest& test, const Rigid& rigid, std::uint32_t first,
                                                       std::uint32_t step, std::uint32_t& inliers) {
  inliers = 0;
  unsigned long long residual = 0;
  for (std::uint32_t i = first; i < pair.source.size; i += step) {
    const Closest found = find_closest(pair.target.closest, pair.target.points, apply(rigid, pair.source.points[i]), test.max_squared);
    if (found.index == kNoValue) continue;
    if (!normals_agree(rotate(rigid, pair.source.normals[i]), pair.target.normals[found.index], test.min_cosine)) continue;
    ++inliers;
    residual += fixed_residual(found.squared_distance, test.inverse_max_squared);
  }
  return residual;
}

/// Finds promising hypotheses of each pair, scores them, and learns from them in which order to look at the groups of points.
void score_leaders(Exec& exec, const ScoreBatch& batch, std::uint32_t total);

/// Chooses the best of the hypotheses whose `inliers` are the pair's most: smallest residual, then lowest number.
DeviceBuffer<BestPose> select_best(Exec& exec, const ScoreBatch& batch, std::uint32_t total);

}  // namespace gpureg::cuda
