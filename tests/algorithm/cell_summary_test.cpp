// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/cell_summary.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include <random>
#include <vector>

#include "algorithm/inlier.hpp"
#include "support/random_clouds.hpp"

namespace gpureg {
namespace {

// A summary may leave a point undecided, but it never decides wrongly: over random sets of
// candidate normals and random moved normals its limits contain what the candidates themselves say.
TEST(CellSummary, LimitsNeverLie) {
  std::mt19937 random(1);
  std::normal_distribution<float> noise;
  const ClosestGeometry geometry = closest_geometry(0.075f, 3.0f);
  for (const float angle : {10.0f, 30.0f, 70.0f, 120.0f, 180.0f}) {
    const SummaryLimits limits(angle, true);
    const float min_cosine = inlier_test(0.075f, angle).min_cosine;
    std::size_t decided = 0;
    for (int k = 0; k < 100000; ++k) {
      const float spread = 0.02f * static_cast<float>(random() % 40);
      const Vec3 axis = test::random_unit(random);
      std::vector<Vec3> points(1 + random() % 5), normals;
      std::vector<std::uint32_t> candidates;
      for (std::size_t i = 0; i < points.size(); ++i) {
        candidates.push_back(static_cast<std::uint32_t>(i));
        points[i] = Vec3{0.01f, 0.01f, 0.01f} * noise(random);
        normals.push_back(normalized_or_zero(axis + test::random_unit(random) * spread));
      }
      const std::uint32_t word =
          summarize_cell(span_of(candidates), {0, 0, 0}, geometry, points.data(), normals.data());
      ASSERT_NE(word, 0u);
      // Near the edge of the cone more often than anywhere.
      const Vec3 moved =
          k % 2 ? test::random_unit(random)
                : normalized_or_zero(axis * std::cos(angle * 0.0174533f + 0.1f * noise(random)) +
                                     normalized_or_zero(cross(axis, test::random_unit(random))) *
                                         std::sin(angle * 0.0174533f));
      const auto part = [&](int shift) {
        return static_cast<float>(static_cast<std::int8_t>(word >> shift)) * (1.0f / 127.0f);
      };
      const float cosine = dot(moved, {part(0), part(8), part(16)});
      const bool possible = cosine >= limits.none_below[word >> 24],
                 certain = cosine >= limits.all_above[word >> 24];
      bool any = false, all = true;
      for (const Vec3& n : normals) {
        any = any || normals_agree(moved, n, min_cosine);
        all = all && normals_agree(moved, n, min_cosine);
      }
      if (any) ASSERT_TRUE(possible) << angle << " " << k;
      if (certain) ASSERT_TRUE(all) << angle << " " << k;
      decided += !possible || certain;
    }
    EXPECT_GT(decided, 20000u) << angle;
  }
}

// The step of the exact arc cosine for every cosine, also next to a whole step.
TEST(CellSummary, StepsAreThoseOfTheExactArcCosine) {
  const auto exact = [](float cosine) {
    const double angle =
        portable::acos(static_cast<double>(cosine < -1.0f ? -1.0f : cosine)) / kDegrees +
        kSummaryQuantisation;
    const int steps = static_cast<int>(std::ceil(angle / kSummaryAngleStep));
    return steps < kSummaryNoBound ? steps : kSummaryNoBound;
  };
  for (int k = -1200; k <= 1100; ++k)
    ASSERT_EQ(summary_step(static_cast<float>(k) / 1100.0f), exact(static_cast<float>(k) / 1100.0f))
        << k;
  for (int step = 1; step < kSummaryNoBound; ++step) {
    float cosine =
        static_cast<float>(std::cos((step * kSummaryAngleStep - kSummaryQuantisation) * kDegrees));
    for (int k = 0; k < 40; ++k) cosine = std::nextafter(cosine, -2.0f);
    for (int k = 0; k < 80; ++k, cosine = std::nextafter(cosine, 2.0f))
      ASSERT_EQ(summary_step(cosine), exact(cosine)) << step << " " << cosine;
  }
}

}  // namespace
}  // namespace gpureg
