// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <gpureg/error.hpp>

#include <cmath>

#include "output.hpp"
#include "support/temporary_folder.hpp"

namespace slam_demo {
namespace {

StampedPose pose(double time, double x, double y, double z) {
  StampedPose p;
  p.time = time;
  p.world_from_camera.translation() = Eigen::Vector3d(x, y, z);
  return p;
}

Trajectory walk() {
  Trajectory t;
  for (int k = 0; k < 60; ++k)
    t.push_back(pose(0.1 * k, 0.1 * k, std::sin(0.3 * k), 0.5 * std::cos(0.2 * k)));
  return t;
}

TEST(Ate, AnyRigidMotionIsNoError) {
  Eigen::Isometry3d move(Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 2, 3).normalized()));
  move.translation() = Eigen::Vector3d(5, -7, 9);
  Trajectory moved = walk();
  for (StampedPose& p : moved) p.world_from_camera = move * p.world_from_camera;
  const AteResult ate = absolute_error(walk(), moved);
  EXPECT_EQ(ate.poses, 60u);
  EXPECT_LT(ate.rmse, 1e-12);
  EXPECT_LT((ate.truth_from_estimate * move).translation().norm(), 1e-9);
}

TEST(Ate, AlternatingErrorsHaveTheirSize) {
  // Errors of +-d across a straight line cannot be aligned away, but for a turn of order d / 60.
  Trajectory truth, estimate;
  for (int k = 0; k < 400; ++k) {
    truth.push_back(pose(k, 0.05 * k, 0, 0));
    estimate.push_back(pose(k, 0.05 * k, k % 2 == 0 ? 0.03 : -0.03, 0));
  }
  const AteResult ate = absolute_error(truth, estimate);
  EXPECT_NEAR(ate.rmse, 0.03, 1e-5);
  EXPECT_NEAR(ate.median, 0.03, 1e-4);
  EXPECT_NEAR(ate.max, 0.03, 1e-3);
}

TEST(Ate, ScaleIsAnError) {
  Trajectory larger = walk();
  for (StampedPose& p : larger) p.world_from_camera.translation() *= 1.1;
  EXPECT_GT(absolute_error(walk(), larger).rmse, 0.1);
}

TEST(Ate, PosesWithoutATrueOneDoNotCount) {
  Trajectory late = walk();
  for (StampedPose& p : late) p.time += 0.02;
  EXPECT_EQ(absolute_error(walk(), late).poses, 0u);
  EXPECT_EQ(absolute_error(walk(), late, 0.03).poses, 60u);
  EXPECT_EQ(absolute_error({}, walk()).poses, 0u);
}

TEST(Trajectory, RoundTrip) {
  const gpureg::test::TemporaryFolder folder;
  Trajectory written = walk();
  written[3].world_from_camera.linear() =
      Eigen::AngleAxisd(3.0, Eigen::Vector3d(0, 1, 1).normalized()).toRotationMatrix();
  write_tum(folder / "t.txt", written);
  const Trajectory read = read_tum(folder / "t.txt");
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t k = 0; k < read.size(); ++k)
    EXPECT_TRUE(read[k].world_from_camera.isApprox(written[k].world_from_camera, 1e-8));
  EXPECT_THROW(read_tum(folder / "missing.txt"), gpureg::IoError);
}

/// A wall z = 0 of 2 x 2 m with a point each centimetre.
gpureg::PointCloud wall() {
  gpureg::PointCloud cloud;
  for (int y = -100; y <= 100; ++y) {
    for (int x = -100; x <= 100; ++x) {
      cloud.points.emplace_back(0.01f * static_cast<float>(x), 0.01f * static_cast<float>(y), 0);
      cloud.normals.emplace_back(0, 0, 1);
    }
  }
  return cloud;
}

TEST(SurfaceError, ShiftedPlane) {
  std::vector<Eigen::Vector3f> map;
  for (int k = 0; k < 1000; ++k)
    map.emplace_back(0.8f * std::sin(static_cast<float>(k)),
                     0.8f * std::cos(2.0f * static_cast<float>(k)), 0.012f);
  const SurfaceError error = surface_error(wall(), map, Eigen::Isometry3d::Identity());
  EXPECT_NEAR(error.mean, 0.012, 1e-6);
  EXPECT_NEAR(error.median, 0.012, 1e-6);
  EXPECT_EQ(error.within, 1);
  Eigen::Isometry3d back = Eigen::Isometry3d::Identity();
  back.translation().z() = -0.012;
  EXPECT_LT(surface_error(wall(), map, back).mean, 1e-6);
}

TEST(SurfaceError, LargerBall) {
  gpureg::PointCloud truth;
  std::vector<Eigen::Vector3f> map;
  for (int k = 0; k < 60000; ++k) {  // Fibonacci: about 0.7 cm apart on a ball of 0.5 m
    const double z = 1 - (2 * k + 1) / 60000.0, r = std::sqrt(1 - z * z), a = 2.39996323 * k;
    const Eigen::Vector3f n(static_cast<float>(r * std::cos(a)),
                            static_cast<float>(r * std::sin(a)), static_cast<float>(z));
    truth.points.push_back(0.5f * n);
    truth.normals.push_back(n);
    if (k % 7 == 0) map.push_back(0.52f * n);
  }
  const SurfaceError error = surface_error(truth, map, Eigen::Isometry3d::Identity());
  // A tangent plane leaves the ball by 0.05 mm within 0.7 cm.
  EXPECT_NEAR(error.mean, 0.02, 1e-4);
  EXPECT_NEAR(error.median, 0.02, 1e-4);
}

TEST(SurfaceError, FarPointsCountAsTwentyCentimetres) {
  const std::vector<Eigen::Vector3f> map = {{0, 0, 0}, {0, 0, 5}, {0, 0, 7}};
  const SurfaceError error = surface_error(wall(), map, Eigen::Isometry3d::Identity());
  EXPECT_NEAR(error.mean, 2 * 0.2 / 3, 1e-6);
  EXPECT_NEAR(error.within, 1.0 / 3, 1e-12);
}

}  // namespace
}  // namespace slam_demo
