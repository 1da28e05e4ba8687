// SPDX-License-Identifier: BSD-3-Clause
// Which clouds get a table of bricks: none whose cells the device could not count. No device
// needed.
#include <gtest/gtest.h>

#include "cuda/prepare/scoring_data.hpp"

namespace gpureg::cuda {
namespace {

ScoringLayout layout_of(Cell lo, Cell hi) { return scoring_layout(2, {2, 3, 2, 2, 1}, {lo, hi}); }

TEST(ScoringLayout, HasATableForARoom) {
  const ScoringLayout l = layout_of({-8, -7, -3}, {8, 6, 12});
  EXPECT_EQ(l.nx, 17);
  EXPECT_EQ(l.ny, 14);
  EXPECT_EQ(l.nz, 16);
  EXPECT_LT(l.runs, l.bricks);
  EXPECT_LT(l.bricks, l.bytes);
}

/// A cell's coordinate is read from the low 22 bits of a float, the blocks on both sides included.
TEST(ScoringLayout, CountsCellsIn22BitsAlongEveryAxis) {
  // 2^19 - 2 blocks, so 2^22 cells with those on both sides
  constexpr std::int32_t kLast = (1 << 19) - 3;
  const Cell ends[3] = {{kLast, 0, 0}, {0, kLast, 0}, {0, 0, kLast}};
  const Cell beyond[3] = {{kLast + 1, 0, 0}, {0, kLast + 1, 0}, {0, 0, kLast + 1}};
  EXPECT_EQ(layout_of({0, 0, 0}, ends[0]).nx, kLast + 1);
  for (int axis = 0; axis < 3; ++axis) {
    const ScoringLayout l = layout_of({0, 0, 0}, beyond[axis]);
    EXPECT_EQ(l.nx, 0) << "axis " << axis;
    EXPECT_EQ(l.runs, l.bricks) << "no table, no memory for it";
  }
  // A large map may have a table of as many places per block; a cloud with stray points may not.
  const CellRange building{{0, 0, 0}, {999, 499, 49}};
  constexpr std::uint32_t kPoints = 16'000'000;
  ClosestGridSize map{3'000'000, 9'000'000, std::uint64_t(84) * kPoints, std::uint64_t(7) * kPoints,
                      std::uint64_t(10) * kPoints};
  EXPECT_EQ(scoring_layout(kPoints, map, building).nx, 1000);
  EXPECT_GT(scoring_layout(kPoints, map, building).bytes,
            map.near_points * 20 + map.list_units * 8 + std::uint64_t(map.bricks) * 128 * 8);
  EXPECT_EQ(layout_of(building.lo, building.hi).nx, 0);
  map.blocks = (1 << 25) + 1;
  EXPECT_EQ(scoring_layout(kPoints, map, building).nx, 0)
      << "its words are not numbered in 32 bits";
  const Cell far{1 << 20, 1 << 20, 1 << 20};
  EXPECT_EQ(layout_of({-(1 << 20), -(1 << 20), -(1 << 20)}, far).nx, 0);
}

}  // namespace
}  // namespace gpureg::cuda
