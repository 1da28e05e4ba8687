// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "gpureg/pcl.hpp"
#include "support/expect_error.hpp"

namespace gpureg {
namespace {

template <typename Point>
class PclView : public ::testing::Test {};
using ViewedPoints =
    ::testing::Types<pcl::PointXYZ, pcl::PointXYZI, pcl::PointXYZRGB, pcl::PointXYZRGBA,
                     pcl::PointXYZL, pcl::PointNormal, pcl::PointXYZINormal, pcl::PointXYZRGBNormal,
                     pcl::PointWithViewpoint, pcl::PointSurfel>;
TYPED_TEST_SUITE(PclView, ViewedPoints);

template <typename Point>
pcl::PointCloud<Point> random_cloud(std::size_t count) {
  std::mt19937 random(4);
  std::normal_distribution<float> normal;
  pcl::PointCloud<Point> cloud;
  for (std::size_t k = 0; k < count; ++k) {
    Point point;
    point.getVector3fMap() = Eigen::Vector3f(normal(random), normal(random), normal(random));
    if constexpr (pcl::traits::has_normal<Point>::value)
      point.getNormalVector3fMap() =
          Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized();
    cloud.push_back(point);
  }
  return cloud;
}

TYPED_TEST(PclView, PointsIntoTheCloud) {
  auto cloud = random_cloud<TypeParam>(100);
  cloud.sensor_origin_ = Eigen::Vector4f(1, 2, 3, 0);
  const PointCloudView view = view_of(cloud);
  EXPECT_NO_THROW(view.validate());
  ASSERT_EQ(view.size, cloud.size());
  for (std::size_t k = 0; k < cloud.size(); ++k) {
    EXPECT_EQ(view.points + k * view.point_stride, &cloud[k].x);
    if constexpr (pcl::traits::has_normal<TypeParam>::value) {
      EXPECT_EQ(view.normals + k * view.normal_stride, &cloud[k].normal_x);
    }
  }
  EXPECT_EQ(view.normals != nullptr, pcl::traits::has_normal<TypeParam>::value);
  ASSERT_EQ(view.viewpoint_count, 1u);
  EXPECT_EQ(Eigen::Vector3f(view.viewpoints[0], view.viewpoints[1], view.viewpoints[2]),
            Eigen::Vector3f(1, 2, 3));
}

TYPED_TEST(PclView, AnEmptyCloudIsAnEmptyView) {
  const pcl::PointCloud<TypeParam> cloud;
  const PointCloudView view = view_of(cloud);
  EXPECT_NO_THROW(view.validate());
  EXPECT_EQ(view.size, 0u);
  EXPECT_TRUE(to_pcl<TypeParam>(view).empty());
}

TYPED_TEST(PclView, ToPclAndBack) {
  auto cloud = random_cloud<TypeParam>(50);
  cloud[7].x = NAN;
  cloud.sensor_origin_ = Eigen::Vector4f(1, 2, 3, 0);
  const auto copy = to_pcl<pcl::PointNormal>(view_of(cloud));
  ASSERT_EQ(copy.size(), cloud.size());
  EXPECT_FALSE(copy.is_dense);
  EXPECT_EQ(copy.sensor_origin_.template head<3>(), Eigen::Vector3f(1, 2, 3));
  for (std::size_t k = 0; k < cloud.size(); ++k) {
    EXPECT_TRUE(k == 7 ? std::isnan(copy[k].x)
                       : copy[k].getVector3fMap() == cloud[k].getVector3fMap());
    if constexpr (pcl::traits::has_normal<TypeParam>::value) {
      EXPECT_EQ(copy[k].getNormalVector3fMap(), cloud[k].getNormalVector3fMap());
    }
  }
}

TEST(PclFeatures, AnySignatureWithAHistogram) {
  const auto cloud = random_cloud<pcl::PointXYZ>(10);
  pcl::PointCloud<pcl::FPFHSignature33> fpfh;
  fpfh.resize(10);
  fpfh[3].histogram[5] = 42;
  PointCloudView view = view_of(cloud, fpfh);
  EXPECT_NO_THROW(view.validate());
  EXPECT_EQ(view.feature_dimension, 33u);
  EXPECT_EQ(view.features[3 * view.feature_stride + 5], 42);
  pcl::PointCloud<pcl::Histogram<153>> spin;
  spin.resize(10);
  EXPECT_EQ(view_of(cloud, spin).feature_dimension, 153u);
  fpfh.resize(9);
  test::expect_error<InvalidArgument>([&] { view_of(cloud, fpfh); }, {"features.size is 9", "10"});
}

TEST(PclFeatures, AViewpointThatIsNotFiniteIsLeftOut) {
  auto cloud = random_cloud<pcl::PointXYZ>(10);
  cloud.sensor_origin_.x() = NAN;
  EXPECT_EQ(view_of(cloud).viewpoint_count, 0u);
}

TEST(PclFeatures, AnOriginThatNobodySetIsNoViewpointOfACloudWithNormals) {
  auto cloud = random_cloud<pcl::PointNormal>(10);
  EXPECT_EQ(view_of(cloud).viewpoint_count, 0u);
  cloud.sensor_origin_.x() = 1;
  EXPECT_EQ(view_of(cloud).viewpoint_count, 1u);
  EXPECT_EQ(view_of(random_cloud<pcl::PointXYZ>(10)).viewpoint_count, 1u);
}

}  // namespace
}  // namespace gpureg
