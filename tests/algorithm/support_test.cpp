// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "algorithm/inlier.hpp"

namespace gpureg {
namespace {

TEST(Support, TotalOrder) {
  // hypothesis is the second member, residual the third.
  const std::vector<Support> ranked = {{10, 7, 5}, {10, 2, 9}, {10, 3, 9}, {9, 1, 0}, {0, 0, 0}};
  for (std::size_t a = 0; a < ranked.size(); ++a)
    for (std::size_t b = 0; b < ranked.size(); ++b) EXPECT_EQ(better(ranked[a], ranked[b]), a < b);
}

TEST(Support, FixedResidualCoversTheRange) {
  const float max = 0.075f;
  EXPECT_EQ(fixed_residual(0, 1 / (max * max)), 0u);
  EXPECT_LE(fixed_residual(max * max, 1 / (max * max)),
            static_cast<std::uint32_t>(kResidualScale) + 1);
  EXPECT_NEAR(fixed_residual(0.5f * max * max, 1 / (max * max)), kResidualScale / 2, 2);
}

TEST(Support, NormalTest) {
  const InlierTest thirty = inlier_test(1, 30), off = inlier_test(1, 180),
                   wide = inlier_test(1, 120);
  const Vec3 z{0, 0, 1}, near{0, std::sin(0.5f), std::cos(0.5f)},
      far{0, std::sin(0.6f), std::cos(0.6f)}, none{0, 0, 0};
  EXPECT_TRUE(normals_agree(z, near, thirty.min_cosine));
  EXPECT_FALSE(normals_agree(z, far, thirty.min_cosine));
  EXPECT_FALSE(normals_agree(z, -z, thirty.min_cosine));
  EXPECT_FALSE(normals_agree(z, none, wide.min_cosine));
  EXPECT_FALSE(normals_agree(none, z, wide.min_cosine));
  EXPECT_TRUE(normals_agree(none, -z, off.min_cosine));
}

}  // namespace
}  // namespace gpureg
