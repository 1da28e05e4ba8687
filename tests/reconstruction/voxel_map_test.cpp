// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "gpureg/reconstruction.hpp"

namespace gpureg::test {
namespace {

TEST(VoxelMap, AveragesPerVoxel) {
  PointCloud cloud;
  cloud.points = {{0.1f, 0.1f, 0.1f}, {0.3f, 0.1f, 0.1f}, {-0.1f, 0.1f, 0.1f}};
  cloud.normals = {{0, 0, 1}, {0, 0, 2}, {1, 0, 0}};
  reconstruction::VoxelMap map(0.5f);
  map.add(cloud.view(), UnalignedIsometry3d::Identity());
  const PointCloud out = map.cloud();
  ASSERT_EQ(out.points.size(), 2u);
  EXPECT_EQ(out.points[0], Eigen::Vector3f(-0.1f, 0.1f, 0.1f));
  // Means in double, rounded to float once.
  EXPECT_LT((out.points[1] - Eigen::Vector3f(0.2f, 0.1f, 0.1f)).norm(), 1e-6f);
  EXPECT_EQ(out.normals[1], Eigen::Vector3f(0, 0, 1));
}

TEST(VoxelMap, MovesScansAndDropsWhatIsNotFinite) {
  PointCloud cloud;
  cloud.points = {{0, 0, 0}, {std::numeric_limits<float>::quiet_NaN(), 0, 0}};
  UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
  pose.translation() << 10, 0, 0;
  reconstruction::VoxelMap map(0.1f);
  map.add(cloud.view(), pose);
  map.add(cloud.view(), UnalignedIsometry3d::Identity());
  const PointCloud out = map.cloud();
  ASSERT_EQ(out.points.size(), 2u);
  EXPECT_EQ(out.points[1], Eigen::Vector3f(10, 0, 0));
  EXPECT_TRUE(out.normals.empty());
}

TEST(VoxelMap, MapCoordinatesKeepTheirDigits) {
  PointCloud cloud;
  cloud.origin = {450123, 5412345, 310};
  for (int k = 0; k < 100; ++k) cloud.points.emplace_back(0.01f * static_cast<float>(k), 0, 0);
  reconstruction::VoxelMap map(0.005f);
  map.add(cloud.view(), UnalignedIsometry3d::Identity());
  const PointCloud out = map.cloud();
  ASSERT_EQ(out.points.size(), 100u);
  // float32 resolves half a metre at 5412345.
  for (std::size_t k = 0; k < 100; ++k)
    EXPECT_LT(
        (out.points[k].cast<double>() + out.origin - cloud.origin - cloud.points[k].cast<double>())
            .norm(),
        1e-6);
}

TEST(VoxelMap, RefusesBadInput) {
  EXPECT_THROW(reconstruction::VoxelMap(0), InvalidArgument);
  reconstruction::VoxelMap map(1);
  EXPECT_THROW(map.add(PointCloudView(), no_pose()), InvalidArgument);
  EXPECT_EQ(map.cloud().points.size(), 0u);
}

}  // namespace
}  // namespace gpureg::test
