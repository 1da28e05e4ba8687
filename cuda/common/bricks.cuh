// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/stage_data.hpp"
#include "math/rigid.hpp"

/// Cells of the closest-point grid on the device: bricks of 8 x 4 x 4 cells, stored only near the
/// surface. One bit marks each existing brick, in runs of 32 along x. One block (two bricks along y
/// and z) on each side of the cloud stays empty. The coarsest description of a cell is a code of
/// four bits (directions.hpp), one word for the eight cells along x: 130 KB for a cloud of 5,000
/// points, which fits the first-level cache.
namespace gpureg::cuda {

/// Coordinates of a cell in the padded table. High bits may be set as long as they are equal in all
/// cells, see BrickMotion.
struct BrickCell {
  std::uint32_t x, y, z;
};

/// Index of the word that holds the code of a cell, if there is one: 16 words per brick, in the
/// order (z, y).
struct BrickWord {
  std::uint32_t number;
  bool there;
};

struct BrickTable {
  std::uint32_t rows_y, words_x, bias;

  BrickTable() = default;
  /// high: bits above the coordinates, a multiple of 2^22.
  __device__ BrickTable(const CellSummaries& v, std::uint32_t high)
      : rows_y(v.brick_rows_y()),
        words_x(v.brick_words_x()),
        bias(((high >> 2) * rows_y + (high >> 2)) * words_x + (high >> 8)) {}

  /// True where the cell is in the table.
  __device__ BrickWord find(BrickCell c, const uint2* runs) const {
    const uint2 run = runs[((c.z >> 2) * rows_y + (c.y >> 2)) * words_x + (c.x >> 8) - bias];
    const std::uint32_t from_here = __funnelshift_l(0u, run.x, c.x >> 3);
    return {run.y - 16u * static_cast<std::uint32_t>(__popc(static_cast<int>(from_here))) +
                (c.z & 3) * 4 + (c.y & 3),
            static_cast<std::int32_t>(from_here) < 0};
  }
};

/// Index of the summary of a cell.
__device__ inline std::size_t cell_in_bricks(BrickWord word, BrickCell c) {
  return std::size_t(word.number) * 8 + (c.x & 7);
}

/// A motion in units of the padded table. Its rounding differs from that of apply() by a small part
/// of a cell, which the margin of the closest-point grid covers.
struct BrickMotion : BrickTable {
  /// Adding it leaves the rounded coordinate in the low bits, at full speed, unlike a conversion.
  static constexpr float kMagic = 12582912.0f;
  static constexpr std::uint32_t kMagicBits = 0x4b400000u;
  float r[9], t[3], last[3];

  BrickMotion() = default;
  __device__ BrickMotion(const Rigid& pose, const CellSummaries& v) : BrickTable(v, kMagicBits) {
    const std::int32_t blocks[3] = {v.nx, v.ny, v.nz};
    const float offset[3] = {v.offset.x, v.offset.y, v.offset.z};
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) {
      last[axis] = static_cast<float>(8 * (blocks[axis] + 2) - 1);
      const float scale = 1.0f / last[axis], cells = v.inverse_cell_size * scale;
#pragma unroll
      for (int k = 0; k < 3; ++k) r[3 * axis + k] = pose.r[3 * axis + k] * cells;
      // Minus half a cell: rounding to the nearest integer is then floor().
      t[axis] = fmaf(pose.t[axis], v.inverse_cell_size, offset[axis] + 7.5f) * scale;
    }
  }

  /// Locations outside, and NaN, clamp to the empty bricks at the border.
  __device__ BrickCell locate(float4 p) const {
    const auto axis = [&](int k) {
      const float unit =
          __saturatef(fmaf(r[3 * k + 2], p.z, fmaf(r[3 * k + 1], p.y, fmaf(r[3 * k], p.x, t[k]))));
      return __float_as_uint(fmaf(unit, last[k], kMagic));
    };
    return {axis(0), axis(1), axis(2)};
  }
};

/// True where the code of a cell, given its word (0 without one), is among the codes that may agree
/// with a class of normals (agreeing_codes()).
__device__ inline bool code_agrees(std::uint32_t word, BrickCell c, std::uint32_t agreeing) {
  return (__funnelshift_r(agreeing, agreeing, __funnelshift_r(word, word, c.x << 2)) & 1u) != 0;
}

}  // namespace gpureg::cuda
