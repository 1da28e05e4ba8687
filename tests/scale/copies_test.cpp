// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "api/with_settings.hpp"
#include "scale/ladder.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

/// Share of the points whose normals show the sensor one side.
double one_side(const PreparedCloud& cloud, const Eigen::Vector3d& sensor) {
  const auto points = cloud.points(), normals = cloud.normals();
  std::size_t to = 0, known = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const float along = normals[k].dot(sensor.cast<float>() - points[k]);
    known += along != 0;
    to += along > 0;
  }
  const double share = static_cast<double>(to) / static_cast<double>(known);
  return std::max(share, 1 - share);
}

// The side of a surface that was seen does not depend on its scale.
TEST(PreparedCopies, HaveTheSidesOfOneOfThem) {
  std::mt19937 random(7);
  const Eigen::Isometry3d pose = test::random_pose(random);
  const std::vector<Eigen::Vector3f> scan = test::moved(pose, test::scan_room(random));
  const PrepareSettings options = resolve(RegistrationOptions{0.05f}).prepare;
  const Context context = Context::cpu(2);
  std::vector<std::unique_ptr<scale::ScaledCloud>> clouds;
  std::vector<PointCloudView> views;
  const std::vector<double> scales{0.4, 0.7, 1.0};
  for (const double scale : scales) {
    clouds.push_back(std::make_unique<scale::ScaledCloud>(PointCloudView(scan), scale));
    views.push_back(clouds.back()->view());
  }
  const std::vector<PreparedCloud> copies = prepare_copies(context, views, scales, options);
  ASSERT_EQ(copies.size(), 3u);
  for (std::size_t k = 0; k < 3; ++k) {
    const PreparedCloud own = prepare(context, views[k], options);
    EXPECT_EQ(copies[k].statistics().viewpoint, own.statistics().viewpoint);
    const Eigen::Vector3d sensor = scales[k] * (pose * test::kRoomSensor.cast<double>());
    EXPECT_GT(one_side(copies[k], sensor), one_side(own, sensor) - 0.01) << scales[k];
    EXPECT_GT(one_side(copies[k], sensor), 0.85) << scales[k];
  }
}

}  // namespace
}  // namespace gpureg
