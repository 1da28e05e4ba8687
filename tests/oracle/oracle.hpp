// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Core>
#include <random>
#include <vector>

#include "gpureg/registration.hpp"
#include "support/random_clouds.hpp"

/// What the oracle tests share: random surfaces, and prepared clouds as PCL sees them.
namespace gpureg::test {

inline std::vector<Eigen::Vector3f> random_surface(std::mt19937& random, std::size_t count,
                                                   float width) {
  std::vector<Eigen::Vector3f> points;
  for (const Vec3& p : bumpy_sheet(random, count, width)) points.emplace_back(p.x, p.y, p.z);
  return points;
}

inline pcl::PointCloud<pcl::PointXYZ>::Ptr pcl_points(const std::vector<Eigen::Vector3f>& points) {
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (const Eigen::Vector3f& p : points) cloud->emplace_back(p.x(), p.y(), p.z());
  return cloud;
}

inline pcl::PointCloud<pcl::Normal>::Ptr pcl_normals(const std::vector<Eigen::Vector3f>& normals) {
  pcl::PointCloud<pcl::Normal>::Ptr cloud(new pcl::PointCloud<pcl::Normal>);
  for (const Eigen::Vector3f& n : normals) cloud->emplace_back(n.x(), n.y(), n.z());
  return cloud;
}

/// How many were compared, and how they differ.
struct Comparison {
  std::vector<double> differences;
  double share_within(double limit) const {
    std::size_t within = 0;
    for (const double d : differences) within += d <= limit;
    return static_cast<double>(within) / static_cast<double>(differences.size());
  }
  void append(const Comparison& other) {
    differences.insert(differences.end(), other.differences.begin(), other.differences.end());
  }
};

/// Angles in degrees, up to sign, between prepared normals and a PCA in double precision
/// (normals_by_pca) or pcl::NormalEstimation, at points whose neighbours define a plane well: the
/// smallest eigenvalue is at most half of the middle one. Elsewhere the direction is decided by
/// rounding, in PCL as much as here.
Comparison compare_normals_with_pca(const PreparedCloud& cloud);
Comparison compare_normals_with_pcl(const PreparedCloud& cloud);

/// L1 distances between prepared FPFH and pcl::FPFHEstimation given the same points and normals. A
/// histogram sums to 300. Left out are points near one without a normal, for which PCL has no
/// notion.
///
/// Which of two points is the source, the one whose normal is closer to the line between them, is
/// decided by rounding where their neighbourhoods are the same and so are their normals; the sign
/// of phi hangs on it. folded: phi without its sign, where everything must agree.
struct FeatureComparison {
  Comparison folded, whole;
};
FeatureComparison compare_features_with_pcl(const PreparedCloud& cloud);

}  // namespace gpureg::test
