// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "gpureg/io.hpp"
#include "io/run_reader.hpp"
#include "io/seed_files.hpp"

namespace gpureg::io {
namespace {

using test::ply_header;
using test::raw;
using test::raw_points;

// What raw_points() makes.
void expect_points(const PointCloud& cloud, int count, bool normals) {
  ASSERT_EQ(cloud.points.size(), static_cast<std::size_t>(count));
  ASSERT_EQ(cloud.normals.size(), normals ? cloud.points.size() : 0);
  for (int k = 0; k < count; ++k) {
    EXPECT_EQ(cloud.points[k], Eigen::Vector3f(k, k + 0.25f, -k));
    if (normals) {
      EXPECT_EQ(cloud.normals[k], Eigen::Vector3f(0, 0, 1));
    }
  }
  EXPECT_TRUE(cloud.viewpoints.empty());
}

TEST(Ply, BinaryOfBothByteOrdersAndBothPrecisions) {
  for (const bool normals : {false, true})
    for (const bool big : {false, true}) {
      const std::string format = big ? "binary_big_endian" : "binary_little_endian";
      expect_points(test::read_content(ply_header(format, 5, "float", normals) + "end_header\n" +
                                       raw_points<float>(5, big, normals)),
                    5, normals);
      expect_points(test::read_content(ply_header(format, 5, "float32", normals) + "end_header\n" +
                                       raw_points<float>(5, big, normals)),
                    5, normals);
      expect_points(test::read_content(ply_header(format, 5, "double", normals) + "end_header\n" +
                                       raw_points<double>(5, big, normals)),
                    5, normals);
      expect_points(test::read_content(ply_header(format, 5, "float64", normals) + "end_header\n" +
                                       raw_points<double>(5, big, normals)),
                    5, normals);
    }
}

TEST(Ply, Text) {
  expect_points(
      test::read_content(ply_header("ascii", 3, "float", true) +
                         "end_header\n0 0.25 0 0 0 1\n1\t+1.25e0 -1 0 0 1 \n\n  2 2.25 -2 0 0 1"),
      3, true);
}

TEST(Ply, TextOfTheRangeOfDouble) {
  const PointCloud cloud = test::read_content(ply_header("ascii", 2, "float", false) +
                                              "end_header\nnan -inf 1e999\n-1e-999 1e39 1e-50\n");
  EXPECT_TRUE(std::isnan(cloud.points[0].x()));
  EXPECT_EQ(cloud.points[0].y(), -INFINITY);
  EXPECT_EQ(cloud.points[0].z(), INFINITY);
  EXPECT_EQ(cloud.points[1].x(), 0);
  EXPECT_EQ(cloud.points[1].y(), INFINITY);
  EXPECT_EQ(cloud.points[1].z(), 0);
}

TEST(Ply, IntegersOfEverySizeAreCoordinates) {
  const std::string header =
      "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty char x\nproperty ushort "
      "y\nproperty int z\nproperty uchar nx\n"
      "property short ny\nproperty uint nz\nend_header\n";
  const PointCloud cloud =
      test::read_content(header + raw(std::int8_t{-5}, true) + raw(std::uint16_t{65535}, true) +
                         raw(std::int32_t{-100000}, true) + raw(std::uint8_t{200}, true) +
                         raw(std::int16_t{-300}, true) + raw(std::uint32_t{4000000000u}, true));
  EXPECT_EQ(cloud.points.at(0), Eigen::Vector3f(-5, 65535, -100000));
  EXPECT_EQ(cloud.normals.at(0), Eigen::Vector3f(200, -300, 4e9f));
}

TEST(Ply, OtherPropertiesInAnyOrderAreSkipped) {
  const std::string header =
      "ply\nformat binary_little_endian 1.0\ncomment by hand\nobj_info none\nelement vertex "
      "2\nproperty uchar red\nproperty float z\n"
      "property double quality\nproperty float x\nproperty short s\nproperty double "
      "y\nend_header\n";
  std::string body;
  for (const float k : {1.0f, 2.0f})
    body += raw(std::uint8_t{7}) + raw(3 * k) + raw(0.5) + raw(k) + raw(std::int16_t{9}) +
            raw(static_cast<double>(2 * k));
  const PointCloud cloud = test::read_content(header + body);
  ASSERT_EQ(cloud.points.size(), 2u);
  EXPECT_EQ(cloud.points[0], Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(cloud.points[1], Eigen::Vector3f(2, 4, 6));
  EXPECT_TRUE(cloud.normals.empty());
}

TEST(Ply, MeshesGiveTheirVertices) {
  const std::string faces =
      "element face 2\nproperty list uchar int vertex_indices\nproperty float "
      "quality\nend_header\n";
  const auto face = [](bool big) {
    return raw(std::uint8_t{3}, big) + raw(0, big) + raw(1, big) + raw(2, big) + raw(0.5f, big) +
           raw(std::uint8_t{0}, big) + raw(0.5f, big);
  };
  for (const bool big : {false, true}) {
    const std::string format = big ? "binary_big_endian" : "binary_little_endian";
    expect_points(test::read_content(ply_header(format, 3, "float", false) + faces +
                                     raw_points<float>(3, big, false) + face(big)),
                  3, false);
  }
  expect_points(test::read_content(ply_header("ascii", 1, "float", false) + faces +
                                   "0 0.25 0\n3 0 0 0 0.5\n0 0.5\n"),
                1, false);
}

TEST(Ply, ElementsBeforeTheVerticesAreSkipped) {
  const std::string vertex =
      "element vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  const std::string before =
      "element camera 1\nproperty double d\nelement strip 2\nproperty list ushort short i\nelement "
      "nothing 99\n";
  const std::string strips =
      raw(std::uint16_t{2}) + raw(std::int16_t{1}) + raw(std::int16_t{2}) + raw(std::uint16_t{0});
  expect_points(test::read_content("ply\nformat binary_little_endian 1.0\n" + before + vertex +
                                   raw(1.0) + strips + raw_points<float>(2, false, false)),
                2, false);
  expect_points(test::read_content("ply\nformat ascii 1.0\n" + before + vertex +
                                   "1.5\n2 1 2\n0\n0 0.25 0\n1 1.25 -1\n"),
                2, false);
}

TEST(Ply, WindowsLineEnds) {
  const std::string header =
      "ply\r\nformat ascii 1.0\r\nelement vertex 1\r\nproperty float x\r\nproperty float "
      "y\r\nproperty float z\r\nend_header\r\n";
  expect_points(test::read_content(header + "0 0.25 0\r\n"), 1, false);
  std::string binary = header;
  binary.replace(binary.find("ascii"), 5, "binary_little_endian");
  expect_points(test::read_content(binary + raw_points<float>(1, false, false)), 1, false);
}

TEST(Ply, ACloudMayBeEmpty) {
  EXPECT_TRUE(
      test::read_content(ply_header("ascii", 0, "float", true) + "end_header\n").points.empty());
  EXPECT_TRUE(
      test::read_content(ply_header("binary_little_endian", 0, "float", false) + "end_header\n")
          .points.empty());
}

TEST(Ply, AFinalLineEndAfterBinaryDataIsNoData) {
  expect_points(test::read_content(ply_header("binary_little_endian", 2, "float", false) +
                                   "end_header\n" + raw_points<float>(2, false, false) + "\n"),
                2, false);
}

}  // namespace
}  // namespace gpureg::io
