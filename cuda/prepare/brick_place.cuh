// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/bricks.cuh"

/// Bricks of a block while a cloud is prepared: its quarters. Cells of a block are in the order
/// (z, y, x), eight along each.
namespace gpureg::cuda {

struct BrickPlace {
  std::uint32_t run, bit;
};

/// Position of the bit of the brick that holds a cell of a block.
__device__ inline BrickPlace place_of_brick(const CellSummaries& v, Cell block, int cell) {
  const auto coordinate = [](std::int32_t c, float offset) {
    return static_cast<std::uint32_t>(c + static_cast<std::int32_t>(offset) / 8 + 1);
  };
  const std::uint32_t upper_y = (cell >> 5) & 1, upper_z = (cell >> 8) & 1,
                      x = coordinate(block.x, v.offset.x),
                      y = 2 * coordinate(block.y, v.offset.y) + upper_y,
                      z = 2 * coordinate(block.z, v.offset.z) + upper_z;
  return {(z * v.brick_rows_y() + y) * v.brick_words_x() + x / 32, 0x80000000u >> (x % 32)};
}

/// BrickTable::find() of a cell of a block.
__device__ inline BrickWord brick_word(const CellSummaries& v, Cell block, int cell) {
  const BrickPlace place = place_of_brick(v, block, cell);
  const uint2 run = v.run[place.run];
  const auto from_here =
      static_cast<std::uint32_t>(__popc(static_cast<int>(run.x & (place.bit * 2 - 1))));
  return {run.y - 16 * from_here +
              static_cast<std::uint32_t>(((cell >> 6) & 3) * 4 + ((cell >> 3) & 3)),
          (run.x & place.bit) != 0};
}

}  // namespace gpureg::cuda
