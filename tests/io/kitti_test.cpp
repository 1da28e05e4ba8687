// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "io/seed_files.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

using test::expect_error;
using test::raw;
using test::TemporaryFolder;

/// Rows of float32 x y z reflectance.
std::string scan(std::initializer_list<Eigen::Vector3f> points) {
  std::string bytes;
  for (const Eigen::Vector3f& p : points)
    for (const float value : {p.x(), p.y(), p.z(), 0.5f}) bytes += raw(value);
  return bytes;
}

TEST(Kitti, RowsBecomePoints) {
  const TemporaryFolder folder;
  const PointCloud cloud =
      read_point_cloud(folder.write("000000.bin", scan({{1, 2, 3}, {-40, 5, 0}})));
  ASSERT_EQ(cloud.points.size(), 2u);
  EXPECT_EQ(cloud.points[0], Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(cloud.points[1], Eigen::Vector3f(-40, 5, 0));
  EXPECT_TRUE(cloud.normals.empty());
  EXPECT_TRUE(cloud.viewpoints.empty());
  EXPECT_EQ(read_point_cloud(folder.write("A.BIN", scan({{1, 2, 3}}))).points.size(), 1u);
}

TEST(Kitti, PointsThatAreNotFiniteStay) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const TemporaryFolder folder;
  const PointCloud cloud =
      read_point_cloud(folder.write("a.bin", scan({{1, 2, 3}, {nan, 0, 0}, {4, 5, 6}})));
  ASSERT_EQ(cloud.points.size(), 3u);
  EXPECT_TRUE(std::isnan(cloud.points[1].x()));
}

TEST(Kitti, WhatIsNoScanIsNamed) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& content,
                           std::initializer_list<std::string> fragments) {
    const std::string path = folder.write("scan.bin", content);
    expect_error<IoError>([&] { read_point_cloud(path); }, {path});
    expect_error<IoError>([&] { read_point_cloud(path); }, fragments);
  };
  const std::string whole = scan({{1, 2, 3}, {4, 5, 6}});
  refused(whole.substr(0, whole.size() - 1), {"31 bytes", "rows of 16 bytes"});
  refused(whole + "x", {"33 bytes"});
  refused("", {"empty"});
  refused(scan({{nan, 0, 0}, {nan, 1, 1}, {1, 2, 3}}), {"2 of 3 rows", "no coordinates"});
  refused(scan({{1e30f, 0, 0}, {-1e9f, 0, 0}, {1, 2, 3}}), {"2 of 3 rows"});
}

TEST(Kitti, TheContentOfOtherFormatsDecides) {
  const TemporaryFolder folder;
  const std::string ply =
      test::ply_header("ascii", 1, "float", false) + "end_header\n1.5 2.5 3.5\n";
  EXPECT_EQ(read_point_cloud(folder.write("ply.bin", ply)).points.front(),
            Eigen::Vector3f(1.5f, 2.5f, 3.5f));
}

}  // namespace
}  // namespace gpureg::io
