// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cell_summary.hpp"
#include "algorithm/inlier.hpp"
#include "cuda/common/closest_cells.cuh"
#include "cuda/common/packed_normal.cuh"
#include "cuda/common/stage_data.hpp"

/// Bounds on a moved point from the summary of its cell, without reading a target point.
namespace gpureg::cuda {

/// One pair for scoring.
struct ScorePair {
  CloudView source, target;
  ScoringOrder order;    ///< of the source
  CellSummaries cells;   ///< of the target
  std::uint32_t limits;  ///< which of the two tables of limits applies
};

struct Limits {
  float none_below, all_above;
};

/// rotate() for bounds: fused, with other last bits.
__device__ inline Vec3 rotate_fast(const Rigid& rigid, float4 n) {
  const auto row = [&](int k) {
    return fmaf(rigid.r[k + 2], n.z, fmaf(rigid.r[k + 1], n.y, rigid.r[k] * n.x));
  };
  return {row(0), row(3), row(6)};
}

/// Tells, by the summary of its cell, whether a source point may be or definitely is an inlier.
/// moved: its normal, zero without one.
__device__ inline bool may_be_inlier(const Limits* limits, std::uint32_t word, Vec3 moved,
                                     bool has_normal, bool& certain) {
  // Without a normal the cosine is 0, as in normals_agree() for limits up to 90 degrees; for larger
  // limits nothing is definite.
  const auto part = [&](int shift) {
    return static_cast<float>(static_cast<std::int32_t>(word << shift) >> 24);
  };
  const float cosine =
      fmaf(moved.z, part(8), fmaf(moved.y, part(16), moved.x * part(24))) * (1.0f / 127.0f);
  const Limits limit = limits[word >> 24];
  certain = cosine >= limit.all_above && (has_normal || limit.all_above <= -2.0f);
  return word != 0 && cosine >= limit.none_below;
}

/// The same for a packed normal.
__device__ inline bool may_be_inlier(const Rigid& rigid, const Limits* limits, std::uint32_t word,
                                     std::uint32_t normal, bool& certain) {
  return may_be_inlier(limits, word,
                       rotate(rigid, normal == kPackedZero ? Vec3{0, 0, 0} : unpack_normal(normal)),
                       normal != kPackedZero, certain);
}

/// Exact test of a moved source point with a known closest target point. moved: its normal; error:
/// largest error of cosines with a packed normal; index: where the index of the point is stored.
__device__ inline bool agrees_with(const ScorePair& pair, const InlierTest& test,
                                   const Rigid& rigid, Vec3 moved, bool has_normal, float error,
                                   const std::uint32_t* index, const ClosestCandidate& closest) {
  if (!(closest.squared_distance <= test.max_squared)) return false;
  if (test.min_cosine <= -1.0f) return true;
  const std::uint32_t normal = __float_as_uint(__ldg(&pair.cells.near[closest.place].w));
  if (normal == kPackedZero || !has_normal) return false;
  const float off = dot(moved, unpack_normal(normal)) - test.min_cosine;
  if (fabsf(off) > error) return off > 0.0f;
  return normals_agree(rotate(rigid, pair.source.normals[*index]),
                       pair.target.normals[__ldg(pair.cells.near_index + closest.place)],
                       test.min_cosine);
}

/// Exact test of a source point in a known cell, by one thread.
__device__ inline bool is_inlier(const ScorePair& pair, const InlierTest& test, const Rigid& rigid,
                                 float4 p, std::uint32_t normal, const std::uint32_t* index,
                                 BrickWord word, BrickCell cell) {
  const Vec3 q = apply(rigid, {p.x, p.y, p.z});
  const uint2 block = __ldg(pair.cells.block + word.number / 16);
  const ClosestCandidate best =
      closest_in_list(pair.cells, block, __ldg(&pair.cells.cell[cell_in_bricks(word, cell)].y), q);
  return best.place != kNoValue &&
         agrees_with(pair, test, rigid,
                     rotate(rigid, normal == kPackedZero ? Vec3{0, 0, 0} : unpack_normal(normal)),
                     normal != kPackedZero, kPackedCosineError, index, best);
}

}  // namespace gpureg::cuda
