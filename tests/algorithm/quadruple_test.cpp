// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/quadruple.hpp"

#include <gtest/gtest.h>

namespace gpureg {
namespace {

MatchedPoints at(float px, float qx, std::uint32_t index) {
  return {{px, 0, 0}, {qx, 0, 0}, index, index};
}

TEST(Quadruple, DependsOnSeedAndNumberOnly) {
  const Quadruple a = draw_quadruple(17, 5, 1000), b = draw_quadruple(17, 5, 1000),
                  c = draw_quadruple(17, 6, 1000), d = draw_quadruple(18, 5, 1000);
  int same_seed = 0, same_number = 0;
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(a.match[k], b.match[k]);
    EXPECT_LT(a.match[k], 1000u);
    same_seed += a.match[k] == c.match[k];
    same_number += a.match[k] == d.match[k];
  }
  EXPECT_LT(same_seed, 4);
  EXPECT_LT(same_number, 4);
}

TEST(Quadruple, SidesWithinTheRatioEitherWay) {
  const float tau2 = 0.81f;
  EXPECT_TRUE(similar_sides(at(0, 0, 0), at(1, 0.91f, 1), tau2));
  EXPECT_TRUE(similar_sides(at(0, 0, 0), at(0.91f, 1, 1), tau2));
  EXPECT_FALSE(similar_sides(at(0, 0, 0), at(1, 0.89f, 1), tau2));
  EXPECT_FALSE(similar_sides(at(0, 0, 0), at(0.89f, 1, 1), tau2));
}

TEST(Quadruple, RepeatedPointsFail) {
  const MatchedPoints a{{0, 0, 0}, {0, 0, 0}, 0, 0}, b{{1, 0, 0}, {1, 0, 0}, 1, 1},
      c{{1, 1, 0}, {1, 1, 0}, 2, 2}, d{{0, 1, 0}, {0, 1, 0}, 3, 3};
  EXPECT_TRUE(passes_polygon_test(a, b, c, d, 0.81f));
  EXPECT_FALSE(passes_polygon_test(a, b, a, d, 0.81f));
  EXPECT_FALSE(passes_polygon_test(a, a, c, d, 0.81f));
}

TEST(Quadruple, TheClosingSideCounts) {
  const MatchedPoints a{{0, 0, 0}, {0, 0, 0}, 0, 0}, b{{1, 0, 0}, {1, 0, 0}, 1, 1},
      c{{1, 1, 0}, {1, 1, 0}, 2, 2};
  // d is one from c in both clouds, but its distance to a differs.
  const MatchedPoints d{{0, 1, 0}, {2, 1, 0}, 3, 3};
  EXPECT_FALSE(passes_polygon_test(a, b, c, d, 0.81f));
}

}  // namespace
}  // namespace gpureg
