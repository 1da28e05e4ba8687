// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pcl/features/fpfh.h>
#include <pcl/search/kdtree.h>

#include "api/with_settings.hpp"
#include "oracle/oracle.hpp"

namespace gpureg::test {

FeatureComparison compare_features_with_pcl(const PreparedCloud& cloud) {
  const auto points = cloud.points(), normals = cloud.normals();
  const auto features = cloud.features();
  const auto xyz = pcl_points(points);
  const pcl::search::KdTree<pcl::PointXYZ>::Ptr tree(new pcl::search::KdTree<pcl::PointXYZ>);
  pcl::FPFHEstimation<pcl::PointXYZ, pcl::Normal, pcl::FPFHSignature33> estimation;
  estimation.setInputCloud(xyz);
  estimation.setInputNormals(pcl_normals(normals));
  estimation.setSearchMethod(tree);
  estimation.setRadiusSearch(static_cast<double>(cloud.settings().feature_radius));
  pcl::PointCloud<pcl::FPFHSignature33> expected;
  estimation.compute(expected);

  // A feature depends on normals as far as two radii away.
  std::vector<char> usable(points.size(), 1);
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!normals[k].isZero(0)) continue;
    const float reach = 2.01f * cloud.settings().feature_radius;
    for (std::size_t other = 0; other < points.size(); ++other)
      if ((points[other] - points[k]).norm() <= reach) usable[other] = 0;
  }
  FeatureComparison comparison;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (!usable[k] || Eigen::Map<const Eigen::VectorXf>(features.data() + 33 * k, 33).isZero(0))
      continue;
    const Eigen::Map<const Eigen::Matrix<float, 33, 1>> ours(features.data() + 33 * k),
        theirs(expected[k].histogram);
    const Eigen::VectorXd difference = (ours - theirs).cast<double>();
    const Eigen::VectorXd phi = difference.tail<11>();
    comparison.whole.differences.push_back(difference.cwiseAbs().sum());
    comparison.folded.differences.push_back(difference.head<22>().cwiseAbs().sum() +
                                            (phi + phi.reverse()).cwiseAbs().sum() / 2);
  }
  return comparison;
}

namespace {

TEST(FpfhOracle, RandomSurfaces) {
  std::mt19937 random(41);
  Comparison folded, whole;
  for (const float voxel_size : {0.05f, 0.1f})
    for (int repeat = 0; repeat < 4; ++repeat) {
      const std::vector<Eigen::Vector3f> points = random_surface(random, 30000, 2);
      const PreparedCloud cloud = prepare(Context::cpu(2), PointCloudView(points),
                                          resolve(RegistrationOptions{voxel_size}).prepare);
      const FeatureComparison comparison = compare_features_with_pcl(cloud);
      folded.append(comparison.folded);
      whole.append(comparison.whole);
    }
  ASSERT_GT(folded.differences.size(), 3000u);
  // Of 300. What differs are the last bits of the arc tangent, and with them, rarely, the bin of an
  // angle on the edge of two: one of some hundred pairs of a neighbour's histogram, weighted.
  EXPECT_GT(folded.share_within(0.001), 0.95);
  EXPECT_EQ(folded.share_within(0.2), 1);
  EXPECT_GT(whole.share_within(0.1), 0.99);
}

}  // namespace
}  // namespace gpureg::test
