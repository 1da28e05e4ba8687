// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/fpfh.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "api/with_settings.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg::cpu {
namespace {

TEST(Features, FpfhAgreesWithExhaustiveNeighbours) {
  std::mt19937 random(1);
  Exec exec(2);
  PrepareSettings options;
  const auto cloud =
      test::prepare_one(exec, test::raw_cloud(test::bumpy_sheet(random, 8000, 2.0f)), options);
  const std::size_t n = cloud->points.size();
  const float r2 = options.feature_radius * options.feature_radius;
  std::vector<double> spfh(n * kFpfhSize, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    if (is_zero(cloud->normals[i])) continue;
    int neighbors = 0;
    std::vector<int> counts(kFpfhSize, 0);
    for (std::size_t j = 0; j < n; ++j) {
      if (j == i || squared_norm(cloud->points[j] - cloud->points[i]) > r2 ||
          is_zero(cloud->normals[j]))
        continue;
      ++neighbors;
      const PairFeature f =
          pair_feature(cloud->points[i], cloud->normals[i], cloud->points[j], cloud->normals[j]);
      if (!f.valid) continue;
      for (int part = 0; part < 3; ++part)
        ++counts[static_cast<std::size_t>(part * kFpfhBins + f.bins[part])];
    }
    for (int b = 0; b < kFpfhSize; ++b)
      spfh[i * kFpfhSize + b] =
          neighbors ? 100.0 * counts[static_cast<std::size_t>(b)] / neighbors : 0;
  }
  for (std::size_t i = 0; i < n; i += 7) {
    std::vector<double> expected(kFpfhSize, 0.0);
    for (std::size_t j = 0; j < n; ++j) {
      const double d2 = static_cast<double>(squared_norm(cloud->points[j] - cloud->points[i]));
      if (d2 > static_cast<double>(r2) || d2 == 0) continue;
      for (int b = 0; b < kFpfhSize; ++b)
        expected[static_cast<std::size_t>(b)] += spfh[j * kFpfhSize + b] / d2;
    }
    for (int part = 0; part < 3; ++part) {
      double sum = 0;
      for (int b = 0; b < kFpfhBins; ++b)
        sum += expected[static_cast<std::size_t>(part * kFpfhBins + b)];
      if (!cloud->features.valid[i]) continue;
      double total = 0;
      for (int b = 0; b < kFpfhBins; ++b) {
        const std::size_t k = static_cast<std::size_t>(part * kFpfhBins + b);
        // Weighted sums of some hundred floats, scaled to 100.
        EXPECT_NEAR(cloud->features.values[i * kFpfhSize + k], 100 * expected[k] / sum, 2e-3);
        total += cloud->features.values[i * kFpfhSize + k];
      }
      EXPECT_NEAR(total, 100, 1e-3);
    }
  }
}

TEST(Features, RowsWithoutAFeatureAreMarked) {
  std::mt19937 random(2);
  std::vector<Vec3> points = test::bumpy_sheet(random, 8000, 2.0f);
  points.push_back({30, 30, 30});
  Exec exec(2);
  const auto cloud = test::prepare_one(exec, test::raw_cloud(points), PrepareSettings{});
  std::size_t missing = 0;
  for (std::size_t i = 0; i < cloud->points.size(); ++i) missing += !cloud->features.valid[i];
  EXPECT_GE(missing, 1u);
  EXPECT_LT(missing, cloud->points.size() / 10);
  EXPECT_EQ(cloud->statistics.points_without_feature, missing);
}

TEST(Features, CustomRowsPassThroughAndNaNIsMarked) {
  std::mt19937 random(3);
  const std::vector<Vec3> points = test::cube(random, 50, 1.0f);
  std::vector<float> rows(50 * 7);
  for (float& v : rows) v = std::uniform_real_distribution<float>()(random);
  rows[20 * 7 + 3] = std::numeric_limits<float>::quiet_NaN();
  RawCloud raw = test::raw_cloud(points);
  raw.features = rows.data();
  raw.feature_dimension = raw.feature_stride = 7;
  PrepareSettings options;
  options.voxel_size = 0;
  Exec exec(1);
  const auto cloud = test::prepare_one(exec, raw, options);
  EXPECT_EQ(cloud->feature_dimension, 7u);
  for (std::size_t i = 0; i < 50; ++i) {
    EXPECT_EQ(cloud->features.valid[i], i != 20);
    if (i != 20) EXPECT_EQ(cloud->features.values[i * 7 + 3], rows[i * 7 + 3]);
  }
}

TEST(Features, TheWideOnesSeeNormalsThatAreAsMuchWider) {
  std::mt19937 random(3);
  Exec exec(2);
  PrepareSettings options;
  const std::vector<Vec3> points = test::bumpy_sheet(random, 20000, 2.0f);
  const RawCloud raw = test::raw_cloud(points);
  auto clouds = downsample(exec, {&raw, 1}, options);
  const auto grids = build_grids(exec, clouds, options);
  const auto wide = compute_wide_features(exec, clouds, grids, options);
  PrepareSettings coarse = options;
  coarse.feature_radius = options.wide_feature_radius;
  const auto expected = compute_features(
      exec, clouds, estimate_normals(exec, clouds, grids, 0.1f * (0.4f / 0.25f)), grids, coarse);
  const auto narrow =
      compute_features(exec, clouds, estimate_normals(exec, clouds, grids, 0.1f), grids, coarse);
  ASSERT_EQ(wide[0].values.size(), clouds[0].points.size() * kFpfhSize);
  EXPECT_EQ(wide[0].values, expected[0].values);
  EXPECT_EQ(wide[0].valid, expected[0].valid);
  EXPECT_NE(wide[0].values, narrow[0].values);
  EXPECT_EQ(wide_normal_radius(0.1f, 0.25f, 0.4f), 0.1f * (0.4f / 0.25f));
  // narrow cells, of which a wide neighbourhood would be millions
  EXPECT_EQ(wide_normal_radius(0.1f, 0.01f, 0.4f), 0.04f);
  options.wide_feature_radius = 0;
  EXPECT_TRUE(compute_wide_features(exec, clouds, grids, options)[0].values.empty());
  options.wide_feature_radius = 0.4f;
  clouds[0].feature_dimension = 5;  // given features: nothing is added to them
  EXPECT_TRUE(compute_wide_features(exec, clouds, grids, options)[0].values.empty());
}

}  // namespace
}  // namespace gpureg::cpu
