// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "gpureg/io.hpp"
#include "io/clouds/lzf.hpp"
#include "io/run_reader.hpp"
#include "io/seed_files.hpp"

namespace gpureg::io {
namespace {

using test::pcd_header;
using test::raw;

TEST(Pcd, TextWithFieldsInAnyOrder) {
  const PointCloud cloud = test::read_content(
      "# comment\nVERSION .7\nFIELDS rgb z histogram y x normal_x normal_y normal_z\nSIZE 4 4 4 8 "
      "4 4 4 4\nTYPE U F F F F F F F\n"
      "COUNT 1 1 3 1 1 1 1 1\nWIDTH 1\nHEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n"
      "4278190080 3 0 0 0 2 1 0 0 1\n0 nan 0 0 0 nan nan nan nan nan\n");
  ASSERT_EQ(cloud.points.size(), 2u);
  EXPECT_EQ(cloud.points[0], Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(cloud.normals.at(0), Eigen::Vector3f(0, 0, 1));
  EXPECT_TRUE(cloud.points[1].array().isNaN().all());
  EXPECT_TRUE(cloud.viewpoints.empty());
}

TEST(Pcd, OldHeadersWithoutCountAndViewpoint) {
  const std::string header =
      "VERSION .5\nCOLUMNS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA "
      "ascii\n";
  EXPECT_EQ(test::read_content(header + "1 2 3\n4 5 6\n").points.at(1), Eigen::Vector3f(4, 5, 6));
}

TEST(Pcd, BinaryWithPaddingAndHistogram) {
  const std::string header =
      "VERSION 0.7\nFIELDS x y z _ h\nSIZE 4 4 8 1 2\nTYPE F F F U I\nCOUNT 1 1 1 4 2\nWIDTH "
      "2\nHEIGHT 1\nPOINTS 2\nDATA binary\n";
  std::string body;
  for (const float k : {1.0f, 5.0f})
    body += raw(k) + raw(k + 1) + raw(static_cast<double>(k + 2)) + std::string(8, '\xff');
  const PointCloud cloud = test::read_content(header + body);
  ASSERT_EQ(cloud.points.size(), 2u);
  EXPECT_EQ(cloud.points[0], Eigen::Vector3f(1, 2, 3));
  EXPECT_EQ(cloud.points[1], Eigen::Vector3f(5, 6, 7));
}

TEST(Pcd, AViewpointAwayFromTheOriginComesAlong) {
  std::string file = pcd_header(1, "ascii") + "1 2 3\n";
  file.replace(file.find("0 0 0 1 0 0 0"), 13, "0.5 -1 2 1 0 0 0");
  const PointCloud cloud = test::read_content(file);
  ASSERT_EQ(cloud.viewpoints.size(), 1u);
  EXPECT_EQ(cloud.viewpoints[0], Eigen::Vector3f(0.5f, -1, 2));
}

TEST(Pcd, CompressedColumnsWithLiteralsAndRepetitions) {
  for (const auto& seed : test::seed_files()) {
    if (seed.content.find("binary_compressed") == std::string::npos) continue;
    const PointCloud cloud = test::read_content(seed.content);
    ASSERT_GE(cloud.points.size(), 2u);
    for (const Eigen::Vector3f& p : cloud.points) EXPECT_TRUE(p.allFinite());
    if (cloud.points.size() == 2) {
      EXPECT_EQ(cloud.points[1], Eigen::Vector3f(0, 0, 0));
    }
  }
  // by columns: x = 1 2, y = 3 4, z = 5 6
  std::string body;
  for (const float v : {1.f, 2.f, 3.f, 4.f, 5.f, 6.f}) body += raw(v);
  const std::string packed = test::pack_literally(body);
  const PointCloud cloud = test::read_content(pcd_header(2, "binary_compressed") +
                                              raw(static_cast<std::uint32_t>(packed.size())) +
                                              raw(std::uint32_t{24}) + packed);
  EXPECT_EQ(cloud.points.at(0), Eigen::Vector3f(1, 3, 5));
  EXPECT_EQ(cloud.points.at(1), Eigen::Vector3f(2, 4, 6));
}

TEST(Lzf, KnownStreams) {
  std::string out;
  EXPECT_TRUE(lzf_decompress("", 0, out));
  EXPECT_TRUE(lzf_decompress(std::string("\x02"
                                         "abc",
                                         4),
                             3, out));
  EXPECT_EQ(out, "abc");
  EXPECT_TRUE(lzf_decompress(std::string("\x01"
                                         "ab\x60\x01",
                                         5),
                             7, out));  // 3 + 2 bytes, from 2 back, over itself
  EXPECT_EQ(out, "abababa");
  EXPECT_TRUE(lzf_decompress(std::string("\x00"
                                         "a\xe0\xff\x00",
                                         5),
                             265, out));  // the longest repetition: 7 + 255 + 2
  EXPECT_EQ(out, std::string(265, 'a'));
}

TEST(Lzf, RefusesCorruptData) {
  std::string out;
  EXPECT_FALSE(lzf_decompress(std::string("\x02"
                                          "ab",
                                          3),
                              3, out))
      << "a run beyond the end";
  EXPECT_FALSE(lzf_decompress(std::string("\x02"
                                          "abc",
                                          4),
                              2, out))
      << "more than announced";
  EXPECT_FALSE(lzf_decompress(std::string("\x02"
                                          "abc",
                                          4),
                              4, out))
      << "less than announced";
  EXPECT_FALSE(lzf_decompress(std::string("\x00"
                                          "a\x20\x01",
                                          4),
                              4, out))
      << "a reference before the start";
  EXPECT_FALSE(lzf_decompress(std::string("\x00"
                                          "a\x20",
                                          3),
                              4, out))
      << "half a reference";
  EXPECT_FALSE(lzf_decompress(std::string("\x00"
                                          "a\xe0",
                                          3),
                              300, out))
      << "a length without its byte";
  EXPECT_FALSE(lzf_decompress(std::string("\x00"
                                          "a\xe0\xff\x00",
                                          5),
                              264, out))
      << "a repetition beyond the size";
}

}  // namespace
}  // namespace gpureg::io
