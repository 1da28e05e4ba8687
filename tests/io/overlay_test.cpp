// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "gpureg/io.hpp"
#include "gpureg/overlay.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

TEST(Overlay, MovesTheSourceAndColoursBoth) {
  const test::TemporaryFolder folder;
  PointCloud source, target;
  source.points = {{1, 2, 3}, {NAN, 0, 0}};
  target.points = {{7, 8, 9}, {4, 5, 6}, {0, INFINITY, 0}};
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()).matrix();
  pose.translation() << 10, 20, 30;
  write_overlay(folder / "o.ply", source, target, pose);

  const PointCloud cloud = read_point_cloud(folder / "o.ply");
  ASSERT_EQ(cloud.points.size(), 3u) << "points that are not finite have no place in a picture";
  EXPECT_LT((cloud.points[0] - Eigen::Vector3f(8, 21, 33)).norm(),
            1e-5f);  // float's last bits at 33
  EXPECT_EQ(cloud.points[1], target.points[0]);
  EXPECT_EQ(cloud.points[2], target.points[1]);

  const std::string bytes = test::content_of(folder / "o.ply");
  const std::string body = bytes.substr(bytes.find("end_header\n") + 11);
  ASSERT_EQ(body.size(), 3 * 15u);
  const auto colour = [&](std::size_t k) {
    return Eigen::Vector3i(static_cast<unsigned char>(body[15 * k + 12]),
                           static_cast<unsigned char>(body[15 * k + 13]),
                           static_cast<unsigned char>(body[15 * k + 14]));
  };
  EXPECT_TRUE(colour(0).x() > 200 && colour(0).y() > 150 && colour(0).z() < 50) << "yellow";
  EXPECT_TRUE(colour(1).x() < 50 && colour(1).z() > 200) << "blue";
  EXPECT_EQ(colour(1), colour(2));
}

}  // namespace
}  // namespace gpureg::io
