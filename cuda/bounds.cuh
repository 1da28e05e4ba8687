// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cell_summary.hpp"
#include "algorithm/inlier.hpp"
#include "packed_normal.cuh"
#include "products.hpp"

/// What is known of a moved point before a single target point is looked at.
namespace gpureg::cuda {

/// One pair as scoring reads it.
struct ScorePair {
  CloudView source, target;
  ScoringOrder order;        ///< of the source
  CellSummaries cells;       ///< of the target
  std::uint32_t limits;      ///< which of the two tables of limits holds
};

struct Limits {
  float none_below, all_above;
};

struct CellInBlock {
  std::uint32_t block, x, y, z;
  /// Of the closest-point grid.
  __device__ std::uint32_t cell() const { return block << 9 | (z & 7) << 6 | (y & 7) << 3 | (x & 7); }
};

/// The motion in units of the target's cells. Rounding may differ from apply() by a small part of a cell, which the margin of the
/// closest-point grid covers.
struct CellMotion {
  float r[9], t[3];
  std::uint32_t nx, ny, nz;

  __device__ CellMotion(const Rigid& pose, const CellSummaries& v)
      : nx(static_cast<std::uint32_t>(v.nx)), ny(static_cast<std::uint32_t>(v.ny)), nz(static_cast<std::uint32_t>(v.nz)) {
#pragma unroll
    for (int k = 0; k < 9; ++k) r[k] = pose.r[k] * v.inverse_cell_size;
    // Half a cell less: then rounding to the nearest integer is floor().
    t[0] = fmaf(pose.t[0], v.inverse_cell_size, v.offset.x - 0.5f);
    t[1] = fmaf(pose.t[1], v.inverse_cell_size, v.offset.y - 0.5f);
    t[2] = fmaf(pose.t[2], v.inverse_cell_size, v.offset.z - 0.5f);
  }

  /// Block that a moved point falls into, 0 where there is none (NaN too), and its place in the block. blocks: the cloud's table or a copy
  /// of it.
  template <typename Block>
  __device__ CellInBlock locate(float4 p, const Block* blocks) const {
    // Adding 1.5 * 2^23 leaves the rounded coordinate in the low bits: full speed, unlike a conversion. What is too large for it has
    // other high bits and is outside.
    constexpr float kMagic = 12582912.0f;
    CellInBlock c;
    c.x = __float_as_uint(fmaf(r[2], p.z, fmaf(r[1], p.y, fmaf(r[0], p.x, t[0]))) + kMagic) - 0x4b400000u;
    c.y = __float_as_uint(fmaf(r[5], p.z, fmaf(r[4], p.y, fmaf(r[3], p.x, t[1]))) + kMagic) - 0x4b400000u;
    c.z = __float_as_uint(fmaf(r[8], p.z, fmaf(r[7], p.y, fmaf(r[6], p.x, t[2]))) + kMagic) - 0x4b400000u;
    const std::uint32_t bx = c.x >> 3, by = c.y >> 3, bz = c.z >> 3;
    c.block = bx < nx && by < ny && bz < nz ? static_cast<std::uint32_t>(blocks[(bz * ny + by) * nx + bx]) : 0u;
    return c;
  }
};

/// Whether a source point may be an inlier, or certainly is one, by the summary of its cell. normal: packed.
__device__ inline bool may_be_inlier(const Rigid& rigid, const Limits* limits, std::uint32_t word, std::uint32_t normal, bool& certain) {
  // Without a normal the cosine is 0, as normals_agree() has it for limits up to 90 degrees; beyond them nothing is certain.
  const Vec3 moved = rotate(rigid, normal == kPackedZero ? Vec3{0, 0, 0} : unpack_normal(normal));
  const auto part = [&](int shift) { return static_cast<float>(static_cast<std::int32_t>(word << shift) >> 24); };
  const float cosine = fmaf(moved.z, part(8), fmaf(moved.y, part(16), moved.x * part(24))) * (1.0f / 127.0f);
  const Limits limit = limits[word >> 24];
  certain = cosine >= limit.all_above && (normal != kPackedZero || limit.all_above <= -2.0f);
  return word != 0 && cosine >= limit.none_below;
}

/// Exact test of a moved source point in a known cell. slot: the point's in the scoring order.
__device__ inline bool is_inlier(const ScorePair& pair, const InlierTest& test, const Rigid& rigid, float4 p, std::uint32_t normal,
                                 std::uint32_t slot, std::uint32_t cell) {
  constexpr std::uint32_t kCells = ClosestGridView::kBlockCells;
  const Vec3 q = apply(rigid, {p.x, p.y, p.z});
  const std::uint32_t list = __ldg(pair.cells.list + cell);
  std::uint32_t first = list >> 8, last = first + (list & 255u);
  if (list == kNoValue) {
    const std::uint32_t* start = pair.target.closest.cell_start.data + static_cast<std::size_t>(cell / kCells - 1) * (kCells + 1) + cell % kCells;
    first = start[0], last = start[1];
  }
  // closest_candidate() on copies of the candidates that lie side by side.
  std::uint32_t best = kNoValue, best_normal = 0;
  float best_squared = 3.402823466e38f;
  for (std::uint32_t k = first; k < last; ++k) {
    const float4 c = __ldg(pair.cells.candidate + k);
    const float d2 = squared_norm(Vec3{c.x, c.y, c.z} - q);
    const bool less = d2 < best_squared;
    best = less ? k : best;
    best_squared = less ? d2 : best_squared;
    best_normal = less ? __float_as_uint(c.w) : best_normal;
  }
  if (best == kNoValue || !(best_squared <= test.max_squared)) return false;
  if (test.min_cosine <= -1.0f) return true;
  if (best_normal == kPackedZero || normal == kPackedZero) return false;
  const float off = dot(rotate(rigid, unpack_normal(normal)), unpack_normal(best_normal)) - test.min_cosine;
  if (fabsf(off) > kPackedCosineError) return off > 0.0f;
  return normals_agree(rotate(rigid, pair.source.normals[pair.order.index[slot]]),
                       pair.target.normals[pair.target.closest.candidates[best]], test.min_cosine);
}

}  // namespace gpureg::cuda
