// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pcl/features/normal_3d.h>
#include <pcl/search/kdtree.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "api/with_settings.hpp"
#include "oracle/oracle.hpp"

namespace gpureg::test {
namespace {

struct Plane {
  Eigen::Vector3d normal;
  bool well_defined;
};

// The definition, in double precision and by brute force.
std::vector<Plane> planes_by_pca(const std::vector<Eigen::Vector3f>& points, double radius) {
  std::vector<Plane> planes;
  std::vector<std::pair<float, std::size_t>> by_x;
  for (std::size_t k = 0; k < points.size(); ++k) by_x.emplace_back(points[k].x(), k);
  std::sort(by_x.begin(), by_x.end());
  for (const Eigen::Vector3f& p : points) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d outer = Eigen::Matrix3d::Zero();
    int count = 0;
    auto it =
        std::lower_bound(by_x.begin(), by_x.end(),
                         std::make_pair(static_cast<float>(p.x() - 1.01 * radius), std::size_t{0}));
    for (; it != by_x.end() && it->first <= p.x() + 1.01 * radius; ++it) {
      const Eigen::Vector3d d = (points[it->second] - p).cast<double>();
      if (d.squaredNorm() > radius * radius) continue;
      sum += d;
      outer += d * d.transpose();
      ++count;
    }
    sum /= count;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(outer / count -
                                                               sum * sum.transpose());
    const Eigen::Vector3d e = eigen.eigenvalues();
    planes.push_back(
        {eigen.eigenvectors().col(0), count >= 5 && e[0] <= 0.5 * e[1] && e[1] > 0.01 * e[2]});
  }
  return planes;
}

double angle_degrees(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) * 180 / M_PI;
}

PreparedCloud random_prepared(std::mt19937& random, float voxel_size,
                              const Eigen::Vector3f& offset) {
  std::vector<Eigen::Vector3f> points = random_surface(random, 30000, 2);
  for (Eigen::Vector3f& p : points) p += offset;
  return prepare(Context::cpu(2), PointCloudView(points),
                 resolve(RegistrationOptions{voxel_size}).prepare);
}

}  // namespace

Comparison compare_normals_with_pca(const PreparedCloud& cloud) {
  const auto points = cloud.points(), normals = cloud.normals();
  const auto planes = planes_by_pca(points, static_cast<double>(cloud.settings().normal_radius));
  Comparison comparison;
  for (std::size_t k = 0; k < points.size(); ++k)
    if (planes[k].well_defined && !normals[k].isZero(0))
      comparison.differences.push_back(angle_degrees(planes[k].normal, normals[k].cast<double>()));
  return comparison;
}

Comparison compare_normals_with_pcl(const PreparedCloud& cloud) {
  const auto points = cloud.points(), normals = cloud.normals();
  const auto planes = planes_by_pca(points, static_cast<double>(cloud.settings().normal_radius));
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(pcl_points(points));
  estimation.setSearchMethod(
      pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
  estimation.setRadiusSearch(static_cast<double>(cloud.settings().normal_radius));
  pcl::PointCloud<pcl::Normal> expected;
  estimation.compute(expected);
  Comparison comparison;
  for (std::size_t k = 0; k < points.size(); ++k)
    if (planes[k].well_defined && !normals[k].isZero(0) &&
        expected[k].getNormalVector3fMap().allFinite())
      comparison.differences.push_back(angle_degrees(
          expected[k].getNormalVector3fMap().cast<double>(), normals[k].cast<double>()));
  return comparison;
}

namespace {

TEST(NormalOracle, RandomSurfaces) {
  std::mt19937 random(31);
  Comparison pca, pcl;
  std::size_t points = 0;
  for (const float voxel_size : {0.03f, 0.05f, 0.1f})
    for (int repeat = 0; repeat < 4; ++repeat) {
      const PreparedCloud cloud = random_prepared(random, voxel_size, Eigen::Vector3f::Zero());
      points += cloud.size();
      pca.append(compare_normals_with_pca(cloud));
      pcl.append(compare_normals_with_pcl(cloud));
    }
  ASSERT_GT(pca.differences.size(), 10000u);
  EXPECT_GT(pca.differences.size(), points / 2)
      << "most points of a surface have a well-defined plane";
  // Float's rounding, 6e-8 of sums of about 1, divided by the gap of the eigenvalues, which may be
  // 1e-3: 1e-4 radians. A neighbour at the very edge of the radius may be in on one side and out on
  // the other, which only the share allows for.
  EXPECT_GT(pca.share_within(0.01), 0.999);
  EXPECT_GT(pcl.share_within(0.05), 0.999);  // PCL sums in float as well, without our scaling
}

TEST(NormalOracle, FarFromTheOrigin) {
  std::mt19937 random(32);
  const PreparedCloud cloud = random_prepared(random, 0.05f, {500, -300, 100});
  // points() are float in the caller's frame, 3e-5 m there, which turns the plane of a 0.1 m
  // neighbourhood by up to 0.05 degrees.
  const Comparison pca = compare_normals_with_pca(cloud);
  ASSERT_GT(pca.differences.size(), 500u);
  EXPECT_GT(pca.share_within(0.2), 0.99);
}

}  // namespace
}  // namespace gpureg::test
