// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>

#include "api/with_settings.hpp"
#include "cpu/prepare/reachable_blocks.hpp"
#include "pipeline/checks.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg::cpu {
namespace {

Closest exhaustive(const std::vector<Vec3>& points, Vec3 q, float max_squared) {
  Closest best{kNoValue, max_squared};
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const float d2 = squared_norm(points[i] - q);
    if (d2 < best.squared_distance || (best.index == kNoValue && d2 == max_squared)) best = {i, d2};
  }
  return best;
}

void expect_exact(const CpuCloud& cloud, std::mt19937& random, int queries, float max_distance) {
  const CloudView view = cloud.view();
  std::normal_distribution<float> near(0, 0.6f * max_distance);
  std::uniform_real_distribution<float> anywhere(-1.2f * cloud.radius, 1.2f * cloud.radius);
  int found = 0;
  for (int k = 0; k < queries; ++k) {
    Vec3 q{anywhere(random), anywhere(random), anywhere(random)};
    if (k % 4 != 0) {
      const Vec3 p = cloud.points[random() % cloud.points.size()];
      q = {p.x + near(random), p.y + near(random), p.z + near(random)};
    }
    const Closest expected = exhaustive(cloud.points, q, max_distance * max_distance);
    const Closest found_one =
        find_closest(view.closest, view.points, q, max_distance * max_distance);
    ASSERT_EQ(found_one.index, expected.index) << k;
    if (expected.index != kNoValue) {
      EXPECT_EQ(found_one.squared_distance, expected.squared_distance);
      ++found;
    }
  }
  EXPECT_GT(found, queries / 4);
}

// No neighbour within the distance may be missed, and the answer is the exhaustive search's to the
// bit.
TEST(ClosestGrid, EqualsExhaustiveSearch) {
  std::mt19937 random(1);
  Exec exec(2);
  PrepareSettings options;
  for (const std::size_t n :
       {std::size_t(1), std::size_t(2), std::size_t(50), std::size_t(4000), std::size_t(30000)}) {
    expect_exact(
        *test::prepare_one(exec, test::raw_cloud(test::bumpy_sheet(random, n, 2.5f)), options),
        random, 4000, 0.075f);
    expect_exact(*test::prepare_one(exec, test::raw_cloud(test::cube(random, n, 1.0f)), options),
                 random, 4000, 0.075f);
  }
}

TEST(ClosestGrid, ExactForSmallerDistancesAndOtherScales) {
  std::mt19937 random(2);
  Exec exec(2);
  for (const float scale : {0.001f, 1.0f, 50.0f}) {
    PrepareSettings options;
    options.voxel_size *= scale;
    options.normal_radius *= scale;
    options.feature_radius *= scale;
    options.max_correspondence_distance *= scale;
    std::vector<Vec3> points = test::bumpy_sheet(random, 5000, 2.0f);
    for (Vec3& p : points) p = p * scale;
    const auto cloud = test::prepare_one(exec, test::raw_cloud(points), options);
    expect_exact(*cloud, random, 3000, 0.075f * scale);
    expect_exact(*cloud, random, 3000, 0.03f * scale);
  }
}

TEST(ClosestGrid, DuplicatesAndUndownsampledClouds) {
  std::mt19937 random(3);
  Exec exec(2);
  PrepareSettings options;
  options.voxel_size = 0;
  std::vector<Vec3> points = test::cube(random, 300, 0.5f);
  const std::vector<Vec3> copy = points;
  points.insert(points.end(), copy.begin(), copy.end());
  expect_exact(*test::prepare_one(exec, test::raw_cloud(points), options), random, 5000, 0.075f);
  const std::vector<Vec3> one_place(500, Vec3{1, 2, 3});
  const auto cloud = test::prepare_one(exec, test::raw_cloud(one_place), options);
  EXPECT_EQ(find_closest(cloud->view().closest, cloud->points.data(), {0.01f, 0, 0}, 0.01f).index,
            0u);
}

// Points exactly on the borders of cells and blocks, where rounding decides to which side a query
// falls.
TEST(ClosestGrid, LatticePointsAndQueries) {
  std::mt19937 random(4);
  Exec exec(2);
  PrepareSettings options;
  options.voxel_size = 0;
  std::vector<Vec3> points;
  for (int x = -4; x <= 4; ++x)
    for (int y = -4; y <= 4; ++y)
      for (int z = -4; z <= 4; ++z)
        points.push_back({0.05f * static_cast<float>(x), 0.05f * static_cast<float>(y),
                          0.05f * static_cast<float>(z)});
  const auto cloud = test::prepare_one(exec, test::raw_cloud(points), options);
  std::uniform_int_distribution<int> step(-30, 30);
  for (int k = 0; k < 20000; ++k) {
    const Vec3 q{0.0125f * static_cast<float>(step(random)),
                 0.025f * static_cast<float>(step(random)) * 0.5f,
                 0.0125f * static_cast<float>(step(random))};
    const float limit = 0.075f * 0.075f;
    EXPECT_EQ(find_closest(cloud->view().closest, cloud->points.data(), q, limit).index,
              exhaustive(cloud->points, q, limit).index);
  }
}

TEST(ClosestGrid, QueriesFarAwayOrNotANumberFindNothing) {
  std::mt19937 random(5);
  Exec exec(1);
  const auto cloud =
      test::prepare_one(exec, test::raw_cloud(test::cube(random, 100, 1.0f)), PrepareSettings{});
  const float nan = std::nanf("");
  for (const Vec3 q : {Vec3{1e30f, 0, 0}, Vec3{nan, 0, 0}, Vec3{0, -1e9f, 0}, Vec3{0, 0, INFINITY}})
    EXPECT_EQ(find_closest(cloud->view().closest, cloud->points.data(), q, 0.005f).index, kNoValue);
}

// More blocks than the number from which on duplicates are removed: the work stays that of a few
// sorts. With one for every point, this test takes minutes.
TEST(ReachableBlocks, AreTheSameHoweverOftenDuplicatesAreRemoved) {
  std::mt19937 random(9);
  const std::vector<Vec3> points = test::cube(random, 30'000, 40.0f);
  const ClosestGeometry g = closest_geometry(0.075f, 35.0f);
  const auto expected = reachable_blocks(points, g, std::size_t(1) << 30);
  EXPECT_GT(expected.size(), points.size());
  for (const std::size_t least : {std::size_t(1), std::size_t(1000), expected.size() / 2})
    EXPECT_EQ(reachable_blocks(points, g, least), expected) << least;
}

// Maps have more candidates than a dense cloud may have, but not more per point.
TEST(ClosestGrid, LimitOfCandidatesGrowsWithThePoints) {
  using pipeline::too_many_candidates;
  constexpr std::uint64_t kMillion = 1'000'000;
  EXPECT_FALSE(too_many_candidates(limits::kMaxGridCandidates, 1));
  EXPECT_TRUE(too_many_candidates(limits::kMaxGridCandidates + 1, kMillion));
  EXPECT_FALSE(too_many_candidates(120 * 4 * kMillion, 4 * kMillion));
  EXPECT_FALSE(too_many_candidates(120 * 16 * kMillion, 16 * kMillion));
  EXPECT_TRUE(too_many_candidates(300 * 16 * kMillion, 16 * kMillion));
  EXPECT_TRUE(too_many_candidates(std::uint64_t(1) << 32, 1000 * kMillion));
}

}  // namespace
}  // namespace gpureg::cpu
