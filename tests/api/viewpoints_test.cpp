// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "algorithm/normal.hpp"
#include "gpureg/error.hpp"
#include "gpureg/point_cloud.hpp"
#include "support/expect_error.hpp"

namespace gpureg {
namespace {

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();

// A floor of 100 points whose normals, of any length, point up.
PointCloud floor_cloud() {
  PointCloud cloud;
  for (int k = 0; k < 100; ++k) cloud.points.emplace_back(0.1f * (k % 10), 0.1f * (k / 10), 0.0f);
  for (int k = 0; k < 100; ++k) cloud.normals.emplace_back(0, 0, 0.01f * (k + 1));
  return cloud;
}

TEST(ShareFacingAway, ByTheSideThatAViewpointIsOn) {
  PointCloud cloud = floor_cloud();
  cloud.viewpoints = {{0, 0, 2}};
  EXPECT_EQ(cloud.view().share_facing_away(), 0);
  cloud.viewpoints = {{0, 0, -2}};
  EXPECT_EQ(cloud.view().share_facing_away(), 1);
  cloud.viewpoints.emplace_back(5, 5, 2);
  EXPECT_EQ(cloud.view().share_facing_away(), 0) << "one of them is enough";
}

TEST(ShareFacingAway, CountsPoints) {
  PointCloud cloud = floor_cloud();
  cloud.viewpoints = {{0, 0, 2}};
  for (int k = 0; k < 30; ++k) cloud.normals[static_cast<std::size_t>(k)] *= -1;
  EXPECT_DOUBLE_EQ(cloud.view().share_facing_away(), 0.3);
}

TEST(ShareFacingAway, UnknownNormalsDoNotCount) {
  PointCloud cloud = floor_cloud();
  EXPECT_EQ(cloud.view().share_facing_away(), 0) << "no viewpoints";
  cloud.viewpoints = {{0, 0, -2}};
  for (int k = 0; k < 10; ++k) {
    cloud.normals[static_cast<std::size_t>(k)] = Eigen::Vector3f::Zero();
    cloud.normals[static_cast<std::size_t>(10 + k)].setConstant(kNoNumber);
    cloud.points[static_cast<std::size_t>(20 + k)].setConstant(kNoNumber);
  }
  EXPECT_DOUBLE_EQ(cloud.view().share_facing_away(), 0.7);
  cloud.normals.clear();
  EXPECT_EQ(cloud.view().share_facing_away(), 0);
  EXPECT_EQ(PointCloudView().share_facing_away(), 0);
}

// Share of facing-away normals above which prepare() takes the viewpoints for wrong instead of the
// normals.
TEST(ShareFacingAway, TheLineIsPreparations) {
  const auto most = static_cast<std::uint32_t>(PointCloudView::kMaxFacingAway * 1000);
  EXPECT_TRUE(turns_back(most, 1000));
  EXPECT_FALSE(turns_back(most + 1, 1000));
}

// Nearly from the side noise decides which side it is.
TEST(ShareFacingAway, NotFromTheSide) {
  PointCloud cloud = floor_cloud();
  cloud.viewpoints = {{20, 20, -0.5f}};
  EXPECT_EQ(cloud.view().share_facing_away(), 0);
}

TEST(ShareFacingAway, StridesAndLies) {
  const PointCloud cloud = floor_cloud();
  std::vector<float> rows;  // x, y, z, nx, ny, nz
  for (std::size_t k = 0; k < 100; ++k) {
    rows.insert(rows.end(), cloud.points[k].data(), cloud.points[k].data() + 3);
    rows.insert(rows.end(), cloud.normals[k].data(), cloud.normals[k].data() + 3);
  }
  const float below[3] = {0, 0, -2};
  PointCloudView view(rows.data(), 100);
  view.point_stride = view.normal_stride = 6;
  view.normals = rows.data() + 3;
  view.viewpoints = below;
  view.viewpoint_count = 1;
  EXPECT_EQ(view.share_facing_away(), 1);
  view.normal_stride = 2;
  test::expect_error<InvalidArgument>([&] { view.share_facing_away(); }, {"cloud.normal_stride"});
}

}  // namespace
}  // namespace gpureg
