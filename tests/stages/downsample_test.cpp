// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <tuple>

#include "api/with_settings.hpp"
#include "cpu/common/stages.hpp"
#include "gpureg/error.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg::cpu {
namespace {

DownsampledCloud downsample_one(const RawCloud& raw, float voxel_size) {
  Exec exec(2);
  PrepareSettings options;
  options.voxel_size = voxel_size;
  return downsample(exec, {&raw, 1}, options).front();
}

TEST(Downsample, CentroidsAgreeWithDouble) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const std::vector<Vec3> points = test::bumpy_sheet(random, 3000, 2.0f);
    const DownsampledCloud cloud = downsample_one(test::raw_cloud(points), 0.05f);
    struct Sum {
      double x = 0, y = 0, z = 0;
      int n = 0;
    };
    std::map<std::tuple<int, int, int>, Sum> voxels;
    for (const Vec3& p : points) {
      // The cell is computed in float, as in every implementation; the mean is checked in double.
      const Vec3 local{p.x - cloud.origin[0], p.y - cloud.origin[1], p.z - cloud.origin[2]};
      const Cell c = cell_of(local, 1.0f / 0.05f);
      Sum& s = voxels[{c.z, c.y, c.x}];
      s.x += p.x;
      s.y += p.y;
      s.z += p.z;
      ++s.n;
    }
    ASSERT_EQ(cloud.points.size(), voxels.size());
    std::size_t k = 0;
    for (const auto& [cell, s] : voxels) {
      // Sums of a few metres in float.
      EXPECT_NEAR(cloud.points[k].x + cloud.origin[0], s.x / s.n, 2e-6);
      EXPECT_NEAR(cloud.points[k].y + cloud.origin[1], s.y / s.n, 2e-6);
      EXPECT_NEAR(cloud.points[k].z + cloud.origin[2], s.z / s.n, 2e-6);
      ++k;
    }
  }
}

TEST(Downsample, DropsAndCountsInvalidPoints) {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              inf = std::numeric_limits<float>::infinity();
  const std::vector<Vec3> points = {{0, 0, 0}, {nan, 0, 0}, {1, 1, 1}, {0, inf, 0}, {0, 0, -inf}};
  const DownsampledCloud cloud = downsample_one(test::raw_cloud(points), 0.05f);
  EXPECT_EQ(cloud.points.size(), 2u);
  EXPECT_EQ(cloud.invalid_points, 3u);
  EXPECT_EQ(cloud.input_points, 5u);
}

TEST(Downsample, WithoutVoxelsKeepsPointsAndOrder) {
  std::mt19937 random(2);
  const std::vector<Vec3> points = test::cube(random, 500, 3.0f);
  const DownsampledCloud cloud = downsample_one(test::raw_cloud(points), 0.0f);
  ASSERT_EQ(cloud.points.size(), points.size());
  for (std::size_t k = 0; k < points.size(); ++k)
    EXPECT_NEAR(cloud.points[k].x + cloud.origin[0], points[k].x, 1e-6);
}

TEST(Downsample, FarFromTheOriginLosesNothing) {
  // Coordinates that float holds exactly at 10 km and beyond: the local cloud must be the same bits
  // as near the origin.
  std::vector<Vec3> near, far;
  std::mt19937 random(3);
  std::uniform_int_distribution<int> place(0, 2047);
  for (int k = 0; k < 2000; ++k) {
    const Vec3 p{static_cast<float>(place(random)) / 1024, static_cast<float>(place(random)) / 1024,
                 static_cast<float>(place(random)) / 1024};
    near.push_back(p);
    far.push_back({p.x + 8192, p.y - 8192, p.z + 4096});
  }
  const DownsampledCloud a = downsample_one(test::raw_cloud(near), 0.0625f),
                         b = downsample_one(test::raw_cloud(far), 0.0625f);
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t k = 0; k < a.points.size(); ++k) {
    EXPECT_EQ(a.points[k].x, b.points[k].x);
    EXPECT_EQ(a.points[k].y, b.points[k].y);
    EXPECT_EQ(a.points[k].z, b.points[k].z);
  }
}

TEST(Downsample, TooFineAVoxelIsAnErrorThatNamesIt) {
  const std::vector<Vec3> points = {{0, 0, 0}, {1e6f, 0, 0}};
  try {
    downsample_one(test::raw_cloud(points), 0.01f);
    FAIL() << "no exception";
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("voxel_size"), std::string::npos);
  }
}

TEST(Downsample, NormalsAndFeaturesAreAveraged) {
  const std::vector<Vec3> points = {{0.01f, 0.01f, 0.01f}, {0.02f, 0.02f, 0.02f}, {1, 1, 1}};
  const std::vector<Vec3> normals = {{0, 0, 2}, {0, 3, 0}, {0, 0, 0}};
  const std::vector<float> features = {1, 10, 3, 30, 5, 50};
  RawCloud raw = test::raw_cloud(points);
  raw.normals = &normals[0].x;
  raw.features = features.data();
  raw.feature_dimension = raw.feature_stride = 2;
  const DownsampledCloud cloud = downsample_one(raw, 0.5f);
  ASSERT_EQ(cloud.points.size(), 2u);
  EXPECT_EQ(cloud.guides[0].y, 1.0f);
  EXPECT_EQ(cloud.guides[0].z, 1.0f);
  EXPECT_TRUE(is_zero(cloud.guides[1]));
  EXPECT_EQ(cloud.features, (std::vector<float>{2, 20, 5, 50}));
}

}  // namespace
}  // namespace gpureg::cpu
