// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"
#include "gpureg/overlay.hpp"
#include "io/run_reader.hpp"
#include "io/seed_files.hpp"
#include "support/cube.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

using test::TemporaryFolder;

const Eigen::Vector3d kUtm(691000.25, 5200000.5, 312.125);

/// Points of a room of 6 m, relative to an offset.
std::vector<Eigen::Vector3d> room(const Eigen::Vector3d& offset, int count = 500) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-3, 3);
  std::vector<Eigen::Vector3d> out;
  for (int k = 0; k < count; ++k)
    out.push_back(offset + Eigen::Vector3d(place(random), place(random), place(random)));
  return out;
}

std::string bytes_of(const std::vector<Eigen::Vector3d>& rows) {
  std::string bytes;
  for (const Eigen::Vector3d& p : rows)
    for (const double axis : p) bytes += test::raw(axis);
  return bytes;
}

std::string text_of(const std::vector<Eigen::Vector3d>& rows) {
  char line[128];
  std::string text;
  for (const Eigen::Vector3d& p : rows) {
    std::snprintf(line, sizeof(line), "%.17g %.17g %.17g\n", p.x(), p.y(), p.z());
    text += line;
  }
  return text;
}

std::string double_pcd(std::size_t count, const std::string& data, const std::string& viewpoint) {
  std::string header = test::pcd_header(static_cast<int>(count), data);
  header.replace(header.find("4 4 4"), 5, "8 8 8");
  return header.replace(header.find("VIEWPOINT 0 0 0"), 15, "VIEWPOINT " + viewpoint);
}

/// Farthest that a row with its origin is from the true point, metres.
double error_of(const PointCloud& cloud, const std::vector<Eigen::Vector3d>& truth) {
  double worst = cloud.points.size() == truth.size() ? 0 : INFINITY;
  for (std::size_t k = 0; k < cloud.points.size() && std::isfinite(worst); ++k)
    worst = std::max(worst, (cloud.origin + cloud.points[k].cast<double>() - truth[k]).norm());
  return worst;
}

// float32 resolves 2.4e-7 m at 3 m; coordinates of 5.2e6 m in float32 are off by up to 0.25 m.
constexpr double kRounding = 5e-7;

TEST(Origin, MapCoordinatesOfPlyAndPcdLoseNothing) {
  const auto rows = room(kUtm);
  const std::string packed = [&] {  // PCD's compressed form goes column by column
    std::string columns;
    for (int axis = 0; axis < 3; ++axis)
      for (const Eigen::Vector3d& p : rows) columns += test::raw(p[axis]);
    const std::string lzf = test::pack_literally(columns);
    return test::raw(static_cast<std::uint32_t>(lzf.size())) +
           test::raw(static_cast<std::uint32_t>(columns.size())) + lzf;
  }();
  const std::string sensor = "691001 5200001 313";
  for (const std::string& content :
       {test::ply_header("binary_little_endian", 500, "double", false) + "end_header\n" +
            bytes_of(rows),
        test::ply_header("ascii", 500, "double", false) + "end_header\n" + text_of(rows),
        double_pcd(500, "binary", sensor) + bytes_of(rows),
        double_pcd(500, "ascii", sensor) + text_of(rows),
        double_pcd(500, "binary_compressed", sensor) + packed}) {
    SCOPED_TRACE(content.substr(0, 300));
    const PointCloud cloud = test::read_content(content);
    EXPECT_LT(error_of(cloud, rows), kRounding);
    EXPECT_EQ(cloud.origin, cloud.origin.array().round().matrix()) << "exact in decimal files";
    if (content.compare(0, 3, "ply") == 0) continue;
    ASSERT_EQ(cloud.viewpoints.size(), 1u);
    EXPECT_LT(
        (cloud.origin + cloud.viewpoints[0].cast<double>() - Eigen::Vector3d(691001, 5200001, 313))
            .norm(),
        kRounding);
  }
}

// Returns without an echo are rows of zeros in many files.
TEST(Origin, StrayPointsDoNotHideIt) {
  auto rows = room(kUtm);
  rows[7] = rows[300] = Eigen::Vector3d::Zero();
  rows[8].x() = NAN;
  const PointCloud cloud =
      test::read_content(test::ply_header("binary_little_endian", 500, "double", false) +
                         "end_header\n" + bytes_of(rows));
  EXPECT_LT((cloud.origin - kUtm).norm(), 10);
}

TEST(Origin, CoordinatesThatFloatResolvesKeepZero) {
  EXPECT_EQ(test::read_content(test::ply_header("ascii", 500, "float", false) + "end_header\n" +
                               text_of(room({0, 0, 0})))
                .origin,
            Eigen::Vector3d(0, 0, 0));
  // 30 m from the origin, and a scan of 6 m.
  EXPECT_EQ(test::read_content(test::ply_header("binary_little_endian", 500, "double", false) +
                               "end_header\n" + bytes_of(room({20, 20, 0})))
                .origin,
            Eigen::Vector3d(0, 0, 0));
  // Whatever has been rounded to float32 stays as it is.
  std::vector<Eigen::Vector3d> rounded = room(kUtm);
  for (Eigen::Vector3d& p : rounded) p = p.cast<float>().cast<double>();
  const PointCloud cloud =
      test::read_content(test::ply_header("binary_little_endian", 500, "double", false) +
                         "end_header\n" + bytes_of(rounded));
  EXPECT_EQ(cloud.origin, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(error_of(cloud, rounded), 0);
}

TEST(Origin, WrittenCloudsReadBack) {
  const TemporaryFolder folder;
  const auto rows = room(kUtm);
  PointCloud cloud = test::read_content(double_pcd(500, "binary", "0 0 0") + bytes_of(rows));
  cloud.normals.assign(500, {0, 0, 1});
  write_point_cloud(folder / "a.ply", cloud);
  const PointCloud again = read_point_cloud(folder / "a.ply");
  EXPECT_LT(error_of(again, rows), kRounding);
  EXPECT_EQ(again.normals, cloud.normals);

  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(1, Eigen::Vector3d::UnitZ()).matrix();
  pose.translation() = kUtm - pose * kUtm;  // turns about the middle of the room
  write_overlay(folder / "o.ply", cloud, cloud, pose);
  std::vector<Eigen::Vector3d> both = rows;
  for (Eigen::Vector3d& p : both) p = pose * p;
  both.insert(both.end(), rows.begin(), rows.end());
  EXPECT_LT(error_of(read_point_cloud(folder / "o.ply"), both), 2 * kRounding);
}

TEST(Origin, SamplesOfAMeshInMapCoordinates) {
  auto vertices = test::cube_vertices();
  const auto box = make_mesh(vertices, test::cube_faces());
  for (Eigen::Vector3d& v : vertices) v += kUtm;
  const PointCloud near = sample_mesh(box);
  const PointCloud far = sample_mesh(make_mesh(vertices, test::cube_faces()));
  ASSERT_EQ(near.points.size(), far.points.size());
  // The area of a face at 5e6 m is good to 1e-9 or so in double: a sample may move by that.
  for (std::size_t k = 0; k < far.points.size(); ++k)
    ASSERT_LT(
        (far.origin + far.points[k].cast<double>() - kUtm - near.points[k].cast<double>()).norm(),
        1e-6);
}

}  // namespace
}  // namespace gpureg::io
