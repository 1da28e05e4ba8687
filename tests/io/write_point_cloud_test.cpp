// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <random>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "gpureg/overlay.hpp"
#include "support/expect_error.hpp"
#include "support/limited_file_size.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

using test::expect_error;
using test::TemporaryFolder;

bool same_bytes(const std::vector<Eigen::Vector3f>& a, const std::vector<Eigen::Vector3f>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0);
}

// Any bit pattern: NaN with payload, denormals, infinities.
std::vector<Eigen::Vector3f> random_bits(std::size_t count, std::mt19937& random) {
  std::vector<Eigen::Vector3f> rows(count);
  for (Eigen::Vector3f& row : rows)
    for (float& v : row) {
      const auto bits = static_cast<std::uint32_t>(random());
      std::memcpy(&v, &bits, 4);
    }
  return rows;
}

TEST(WritePointCloud, RoundTripKeepsEveryBit) {
  std::mt19937 random(1);
  const TemporaryFolder folder;
  for (const std::size_t count : {0u, 1u, 2u, 1000u}) {
    PointCloud cloud;
    cloud.points = random_bits(count, random);
    write_point_cloud(folder / "a.ply", cloud);
    PointCloud back = read_point_cloud(folder / "a.ply");
    EXPECT_TRUE(same_bytes(back.points, cloud.points));
    EXPECT_TRUE(back.normals.empty());
    cloud.normals = random_bits(count, random);
    write_point_cloud(folder / "a.ply", cloud);
    back = read_point_cloud(folder / "a.ply");
    EXPECT_TRUE(same_bytes(back.points, cloud.points));
    EXPECT_TRUE(same_bytes(back.normals, cloud.normals));
  }
}

TEST(WritePointCloud, RefusesNormalsThatDoNotFit) {
  const TemporaryFolder folder;
  PointCloud cloud;
  cloud.points.resize(3);
  cloud.normals.resize(2);
  expect_error<InvalidArgument>([&] { write_point_cloud(folder / "a.ply", cloud); },
                                {"cloud.normals", "2", "3"});
  EXPECT_EQ(folder.count(), 0u);
}

TEST(WritePointCloud, UnwritableOutputAndFullDisk) {
  const TemporaryFolder folder;
  PointCloud cloud;
  cloud.points.assign(10000, Eigen::Vector3f::Ones());
  expect_error<IoError>([&] { write_point_cloud(folder / "no/a.ply", cloud); },
                        {"no/a.ply", "No such file"});
  expect_error<IoError>([&] { write_point_cloud(folder.path(), cloud); }, {"folder"});
  if (std::filesystem::exists("/dev/full")) {
    expect_error<IoError>([&] { write_point_cloud("/dev/full", cloud); },
                          {"/dev/full", "No space left"});
  }
  const test::LimitedFileSize limit(5000);
  expect_error<IoError>([&] { write_point_cloud(folder / "a.ply", cloud); }, {"a.ply"});
  expect_error<IoError>(
      [&] { write_overlay(folder / "b.ply", cloud, cloud, Eigen::Isometry3d::Identity()); },
      {"b.ply"});
  EXPECT_EQ(folder.count(), 0u);
}

}  // namespace
}  // namespace gpureg::io
