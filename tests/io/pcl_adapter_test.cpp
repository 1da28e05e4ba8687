// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "gpureg/pcl.hpp"
#include "support/expect_error.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using test::rotation_error_degrees;
using test::translation_error;

// A cloud, and the sensor where the motion has brought it.
template <typename Point>
typename pcl::PointCloud<Point>::Ptr cloud_of(const std::vector<Eigen::Vector3f>& points,
                                              const Eigen::Isometry3d& motion) {
  const Eigen::Vector3f sensor = (motion * test::kRoomSensor.cast<double>()).cast<float>();
  PointCloudView view(points);
  view.viewpoints = sensor.data();
  view.viewpoint_count = 1;
  return pcl::make_shared<pcl::PointCloud<Point>>(to_pcl<Point>(view));
}

template <typename Point>
typename pcl::PointCloud<Point>::Ptr scan(
    std::mt19937& random, const Eigen::Isometry3d& motion = Eigen::Isometry3d::Identity()) {
  return cloud_of<Point>(test::moved(motion, test::scan_room(random)), motion);
}

RegistrationOptions quick_options() {
  RegistrationOptions options{0.05f};
  options.quadruples = 200'000;
  return options;
}

// A thirtieth of a voxel and the angle that it is at arm's length: what point-to-plane leaves of 1
// mm of noise on thousands of points is far less, what a wrong pose has is far more.
void expect_pose(const Eigen::Isometry3d& truth, const Eigen::Isometry3d& found) {
  EXPECT_LT(translation_error(truth, found), 0.005);
  EXPECT_LT(rotation_error_degrees(truth, found), 0.2);
}

template <typename Point>
class PclAdapter : public ::testing::Test {};
using AdaptedPoints = ::testing::Types<pcl::PointXYZ, pcl::PointXYZRGB, pcl::PointNormal>;
TYPED_TEST_SUITE(PclAdapter, AdaptedPoints);

TYPED_TEST(PclAdapter, FindsTheKnownPoseAsTheDirectCallDoes) {
  std::mt19937 random(2);
  const Eigen::Isometry3d truth = test::random_pose(random);
  const auto target = scan<TypeParam>(random, truth);
  const auto source = scan<TypeParam>(random);
  const Context context = Context::cpu(2);

  const RegistrationResult direct =
      align(context, view_of(*source), view_of(*target), quick_options());
  ASSERT_EQ(direct.status, RegistrationStatus::aligned) << to_string(direct.reason);
  expect_pose(truth, direct.target_from_source);

  PclRegistration<TypeParam> adapter(quick_options(), context);
  adapter.setInputSource(source);
  adapter.setInputTarget(target);
  pcl::PointCloud<TypeParam> moved;
  adapter.align(moved);
  ASSERT_TRUE(adapter.hasConverged());
  EXPECT_EQ(adapter.result().target_from_source.matrix(), direct.target_from_source.matrix());
  const Eigen::Matrix4f direct_matrix = direct.target_from_source.matrix().template cast<float>();
  EXPECT_EQ(adapter.getFinalTransformation(), direct_matrix);

  ASSERT_EQ(moved.size(), source->size());
  for (std::size_t k = 0; k < moved.size(); k += 97) {
    const Eigen::Vector3f expected =
        (direct.target_from_source * (*source)[k].getVector3fMap().template cast<double>())
            .template cast<float>();
    EXPECT_LT((moved[k].getVector3fMap() - expected).norm(),
              1e-5f);  // float's last bits at a few metres
  }
  // Mean squared distance to the nearest point of the other scan, whose spacing is about 1.6 cm.
  EXPECT_LT(adapter.getFitnessScore(), 0.016 * 0.016);
}

TEST(PclAdapterUse, WorksThroughTheBaseClassAndKeepsTheTargetForManySources) {
  std::mt19937 random(3);
  const Eigen::Isometry3d truth = test::random_pose(random);
  PclRegistration<pcl::PointXYZ> adapter(quick_options(), Context::cpu(2));
  pcl::Registration<pcl::PointXYZ, pcl::PointXYZ>& base = adapter;
  base.setInputTarget(scan<pcl::PointXYZ>(random, truth));
  for (int k = 0; k < 2; ++k) {
    const Eigen::Isometry3d more = test::random_pose(random);
    base.setInputSource(scan<pcl::PointXYZ>(random, more));
    pcl::PointCloud<pcl::PointXYZ> moved;
    base.align(moved);
    ASSERT_TRUE(base.hasConverged());
    expect_pose(truth * more.inverse(),
                Eigen::Isometry3d(base.getFinalTransformation().cast<double>()));
  }
}

TEST(PclAdapterUse, IndicesSelectPointsOfTheSource) {
  std::mt19937 random(5);
  const Eigen::Isometry3d truth = test::random_pose(random);
  const auto target = scan<pcl::PointXYZ>(random, truth);
  auto points = test::scan_room(random);
  const std::size_t good = points.size();
  std::uniform_real_distribution<float> unit(-5, 5);
  for (int k = 0; k < 20000; ++k)
    points.emplace_back(unit(random), unit(random), unit(random));  // clutter, not selected
  const auto source = cloud_of<pcl::PointXYZ>(points, Eigen::Isometry3d::Identity());
  const pcl::IndicesPtr indices = pcl::make_shared<pcl::Indices>();
  for (std::size_t k = 0; k < good; ++k) indices->push_back(static_cast<pcl::index_t>(k));
  PclRegistration<pcl::PointXYZ> adapter(quick_options(), Context::cpu(2));
  adapter.setInputTarget(target);
  adapter.setInputSource(source);
  adapter.setIndices(indices);
  pcl::PointCloud<pcl::PointXYZ> moved;
  adapter.align(moved);
  ASSERT_TRUE(adapter.hasConverged());
  EXPECT_EQ(moved.size(), good);
  expect_pose(truth, adapter.result().target_from_source);
}

TEST(PclAdapterUse, NoAlignmentIsNotConvergedAndSaysWhy) {
  std::mt19937 random(6);
  PclRegistration<pcl::PointXYZ> adapter(quick_options(), Context::cpu(2));
  adapter.setInputTarget(scan<pcl::PointXYZ>(random));
  adapter.setInputSource(
      cloud_of<pcl::PointXYZ>({{0, 0, 0}, {1, 0, 0}}, Eigen::Isometry3d::Identity()));
  pcl::PointCloud<pcl::PointXYZ> moved;
  adapter.align(moved);
  EXPECT_FALSE(adapter.hasConverged());
  EXPECT_EQ(adapter.result().reason, RegistrationReason::too_few_source_points);
  EXPECT_EQ(adapter.getFinalTransformation(), Eigen::Matrix4f::Identity());
  ASSERT_EQ(moved.size(), 2u);
  EXPECT_EQ(moved[1].x, 1);
}

TEST(PclAdapterUse, OptionsAreCheckedAndTakeEffect) {
  std::mt19937 random(7);
  PclRegistration<pcl::PointXYZ> adapter(quick_options(), Context::cpu(2));
  RegistrationOptions options = quick_options();
  options.min_confidence = 2;
  test::expect_error<InvalidArgument>([&] { adapter.setOptions(options); },
                                      {"min_confidence", "2"});
  adapter.setInputTarget(scan<pcl::PointXYZ>(random));
  adapter.setInputSource(scan<pcl::PointXYZ>(random));
  pcl::PointCloud<pcl::PointXYZ> moved;
  adapter.align(moved);
  EXPECT_TRUE(adapter.hasConverged());
  const auto points = adapter.result().statistics.target_points;
  options = RegistrationOptions{0.1f};
  options.quadruples = 100'000;
  adapter.setOptions(options);
  adapter.align(moved);
  EXPECT_LT(adapter.result().statistics.target_points, points)
      << "the prepared target of the old options was used";
  EXPECT_EQ(adapter.getOptions().voxel_size, 0.1f);
  adapter.setContext(Context::cpu(1));
  EXPECT_EQ(adapter.getContext().threads(), 1u);
  adapter.align(moved);
  EXPECT_TRUE(adapter.hasConverged());
}

}  // namespace
}  // namespace gpureg
