// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/cell.hpp"

#include <gtest/gtest.h>

#include <random>

namespace gpureg {
namespace {

TEST(Cell, KeysGoThereAndBackAndKeepTheOrder) {
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int32_t> value(-kCellBias, kCellBias - 1);
  for (int k = 0; k < 10000; ++k) {
    const Cell a{value(random), value(random), value(random)},
        b{value(random), value(random), value(random)};
    const Cell back = cell_from_key(cell_key(a));
    EXPECT_EQ(back.x, a.x);
    EXPECT_EQ(back.y, a.y);
    EXPECT_EQ(back.z, a.z);
    const auto rank = [](Cell c) { return std::make_tuple(c.z, c.y, c.x); };
    EXPECT_EQ(cell_key(a) < cell_key(b), rank(a) < rank(b));
    EXPECT_NE(cell_key(a), kEmptyKey);
  }
}

TEST(Cell, FloorOfNegativeAndWholeNumbers) {
  EXPECT_EQ(floor_to_int(-0.1f), -1);
  EXPECT_EQ(floor_to_int(-1.0f), -1);
  EXPECT_EQ(floor_to_int(0.0f), 0);
  EXPECT_EQ(floor_to_int(2.999f), 2);
  EXPECT_EQ(floor_to_int(3.0f), 3);
}

TEST(Cell, Range) {
  EXPECT_TRUE(in_key_range({-kCellBias, 0, kCellBias - 1}));
  EXPECT_FALSE(in_key_range({-kCellBias - 1, 0, 0}));
  EXPECT_FALSE(in_key_range({0, kCellBias, 0}));
}

}  // namespace
}  // namespace gpureg
