// SPDX-License-Identifier: BSD-3-Clause
// Our readers against PCL's writers, our writer against PCL's reader: random clouds, every form
// that PCL knows.
#include <gtest/gtest.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include <cmath>
#include <cstring>
#include <random>

#include "gpureg/io.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

void set_normal(pcl::PointXYZ&, const Eigen::Vector3f&) {}
void set_normal(pcl::PointXYZRGB& p, const Eigen::Vector3f&) { p.r = p.g = 200; }
void set_normal(pcl::PointXYZI& p, const Eigen::Vector3f&) { p.intensity = 0.5f; }
void set_normal(pcl::PointNormal& p, const Eigen::Vector3f& n) { p.getNormalVector3fMap() = n; }
void set_normal(pcl::PointXYZRGBNormal& p, const Eigen::Vector3f& n) {
  p.getNormalVector3fMap() = n;
}

template <typename Point>
class PclOracle : public ::testing::Test {};
using OraclePoints = ::testing::Types<pcl::PointXYZ, pcl::PointXYZI, pcl::PointXYZRGB,
                                      pcl::PointNormal, pcl::PointXYZRGBNormal>;
TYPED_TEST_SUITE(PclOracle, OraclePoints);

template <typename Point>
struct Example {
  pcl::PointCloud<Point> pcl;
  PointCloud expected;
};

// Some clouds compress well (coordinates on a raster), others not at all.
template <typename Point>
Example<Point> random_cloud(std::mt19937& random, bool on_raster) {
  std::normal_distribution<float> normal;
  Example<Point> example;
  const auto count = 1 + random() % 3000;
  for (std::size_t k = 0; k < count; ++k) {
    Eigen::Vector3f p(normal(random), normal(random), 100 * normal(random));
    if (on_raster) p = p.array().round();
    if (random() % 50 == 0) p.setConstant(NAN);
    const Eigen::Vector3f n =
        Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized();
    Point point;
    point.getVector3fMap() = p;
    set_normal(point, n);
    example.pcl.push_back(point);
    example.expected.points.push_back(p);
    if (pcl::traits::has_normal<Point>::value) example.expected.normals.push_back(n);
  }
  return example;
}

bool same(const std::vector<Eigen::Vector3f>& a, const std::vector<Eigen::Vector3f>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t k = 0; k < a.size(); ++k)
    for (int axis = 0; axis < 3; ++axis)
      if (!(a[k][axis] == b[k][axis] || (std::isnan(a[k][axis]) && std::isnan(b[k][axis]))))
        return false;
  return true;
}

bool similar(const std::vector<Eigen::Vector3f>& a, const std::vector<Eigen::Vector3f>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t k = 0; k < a.size(); ++k)
    if (!((a[k] - b[k]).array().abs() <= 5.1e-6f * b[k].array().abs()).all()) return false;
  return true;
}

PointCloud finite(const PointCloud& cloud) {
  PointCloud kept;
  for (std::size_t k = 0; k < cloud.points.size(); ++k) {
    if (!cloud.points[k].allFinite()) continue;
    kept.points.push_back(cloud.points[k]);
    if (!cloud.normals.empty()) kept.normals.push_back(cloud.normals[k]);
  }
  return kept;
}

TYPED_TEST(PclOracle, ReadsWhatPclWrites) {
  const test::TemporaryFolder folder;
  std::mt19937 random(17);
  for (int repeat = 0; repeat < 30; ++repeat) {
    const auto example = random_cloud<TypeParam>(random, repeat % 2 == 0);
    // Nine digits bring every float back.
    pcl::PCDWriter pcd;
    ASSERT_EQ(pcd.writeASCII(folder / "a.pcd", example.pcl, 9), 0);
    ASSERT_EQ(pcd.writeBinary(folder / "b.pcd", example.pcl), 0);
    ASSERT_EQ(pcd.writeBinaryCompressed(folder / "c.pcd", example.pcl), 0);
    pcl::PCLPointCloud2 message;
    pcl::toPCLPointCloud2(example.pcl, message);
    pcl::PLYWriter ply;
    const Eigen::Vector4f origin = Eigen::Vector4f::Zero();
    const Eigen::Quaternionf orientation = Eigen::Quaternionf::Identity();
    for (const bool camera :
         {false,
          true}) {  // with a camera element behind the vertices, or with a range grid before it
      ASSERT_EQ(ply.writeASCII(folder / (camera ? "d.ply" : "e.ply"), message, origin, orientation,
                               9, camera),
                0);
      ASSERT_EQ(ply.writeBinary(folder / (camera ? "f.ply" : "g.ply"), message, origin, orientation,
                                camera),
                0);
    }
    for (const char* name : {"a.pcd", "b.pcd", "c.pcd", "d.ply", "e.ply", "f.ply", "g.ply"}) {
      SCOPED_TRACE(name);
      const PointCloud cloud = read_point_cloud(folder / name);
      if (std::string(name) == "e.ply") {
        // With a range grid PCL's text writer leaves out points that are not finite, and writes six
        // digits whatever it is asked for.
        const PointCloud expected = finite(example.expected);
        EXPECT_TRUE(similar(cloud.points, expected.points));
        EXPECT_TRUE(similar(cloud.normals, expected.normals));
      } else {
        EXPECT_TRUE(same(cloud.points, example.expected.points));
        EXPECT_TRUE(same(cloud.normals, example.expected.normals));
      }
    }
  }
}

TEST(PclOracleWriter, PclReadsOurFiles) {
  const test::TemporaryFolder folder;
  std::mt19937 random(18);
  pcl::console::setVerbosityLevel(pcl::console::L_ERROR);  // it misses a curvature
  for (int repeat = 0; repeat < 20; ++repeat) {
    auto example = random_cloud<pcl::PointNormal>(random, false);
    write_point_cloud(folder / "a.ply", example.expected);
    pcl::PointCloud<pcl::PointNormal> cloud;
    ASSERT_EQ(pcl::io::loadPLYFile(folder / "a.ply", cloud), 0);
    PointCloud back;
    for (const auto& p : cloud) {
      back.points.push_back(p.getVector3fMap());
      back.normals.push_back(p.getNormalVector3fMap());
    }
    EXPECT_TRUE(same(back.points, example.expected.points));
    EXPECT_TRUE(same(back.normals, example.expected.normals));
  }
}

}  // namespace
}  // namespace gpureg::io
