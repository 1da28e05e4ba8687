// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <pcl/filters/voxel_grid.h>

#include <array>
#include <cmath>
#include <map>

#include "api/with_settings.hpp"
#include "oracle/oracle.hpp"

namespace gpureg::test {
namespace {

using VoxelKey = std::array<long, 3>;
using Centroids = std::map<VoxelKey, Eigen::Vector3d>;

VoxelKey voxel_of_point(const Eigen::Vector3f& p, double voxel_size) {
  VoxelKey key;
  for (int axis = 0; axis < 3; ++axis)
    key[static_cast<std::size_t>(axis)] =
        std::lround(std::floor(static_cast<double>(p[axis]) / voxel_size));
  return key;
}

// The definition, in double precision.
Centroids centroids_of(const std::vector<Eigen::Vector3f>& points, double voxel_size) {
  std::map<VoxelKey, std::pair<Eigen::Vector3d, int>> sums;
  for (const Eigen::Vector3f& p : points) {
    auto& [sum, count] =
        sums.try_emplace(voxel_of_point(p, voxel_size), Eigen::Vector3d::Zero(), 0).first->second;
    sum += p.cast<double>();
    ++count;
  }
  Centroids centroids;
  for (const auto& [key, sum] : sums) centroids[key] = sum.first / sum.second;
  return centroids;
}

// Points that stay 2 % of a voxel away from its sides, so that float and double agree about which
// one they are in.
std::vector<Eigen::Vector3f> clear_points(std::mt19937& random, std::size_t count, float voxel_size,
                                          int extent) {
  std::uniform_int_distribution<int> cell(-extent, extent);
  std::uniform_real_distribution<double> inside(0.02, 0.98);
  std::vector<Eigen::Vector3f> points(count);
  for (Eigen::Vector3f& p : points)
    for (float& v : p)
      v = static_cast<float>((cell(random) + inside(random)) * static_cast<double>(voxel_size));
  return points;
}

// Small radii: only the voxels matter here.
std::vector<Eigen::Vector3f> downsampled(const std::vector<Eigen::Vector3f>& points,
                                         float voxel_size) {
  PrepareSettings options = resolve(RegistrationOptions{voxel_size}).prepare;
  options.normal_radius = options.feature_radius = voxel_size;
  options.wide_feature_radius = 0;
  return prepare(Context::cpu(2), PointCloudView(points), options).points();
}

TEST(VoxelOracle, CentroidsInDoublePrecision) {
  std::mt19937 random(51);
  for (int repeat = 0; repeat < 60; ++repeat) {
    const float voxel_size = std::array{0.01f, 0.05f, 0.25f, 1.0f}[random() % 4];
    const std::size_t count = 1 + random() % 5000;
    const auto points =
        clear_points(random, count, voxel_size, 1 + static_cast<int>(random() % 12));
    const Centroids expected = centroids_of(points, static_cast<double>(voxel_size));
    const auto found = downsampled(points, voxel_size);
    ASSERT_EQ(found.size(), expected.size());
    for (const Eigen::Vector3f& p : found) {
      const auto it = expected.find(voxel_of_point(p, static_cast<double>(voxel_size)));
      ASSERT_NE(it, expected.end());
      // Sums of at most 5,000 floats within 13 voxels of the local origin, each addition off by
      // 6e-8 of the sum at worst.
      EXPECT_LT((p.cast<double>() - it->second).norm(), 1e-4 * static_cast<double>(voxel_size));
    }
  }
}

TEST(VoxelOracle, PclVoxelGrid) {
  std::mt19937 random(52);
  for (int repeat = 0; repeat < 30; ++repeat) {
    const float voxel_size = std::array{0.02f, 0.05f, 0.1f}[random() % 3];
    const auto points = clear_points(random, 1 + random() % 20000, voxel_size, 6);
    pcl::VoxelGrid<pcl::PointXYZ> grid;
    grid.setInputCloud(pcl_points(points));
    grid.setLeafSize(voxel_size, voxel_size, voxel_size);
    pcl::PointCloud<pcl::PointXYZ> filtered;
    grid.filter(filtered);
    std::map<VoxelKey, Eigen::Vector3f> expected;
    for (const auto& p : filtered)
      expected[voxel_of_point(p.getVector3fMap(), static_cast<double>(voxel_size))] =
          p.getVector3fMap();
    const auto found = downsampled(points, voxel_size);
    ASSERT_EQ(found.size(), expected.size());
    for (const Eigen::Vector3f& p : found) {
      const auto it = expected.find(voxel_of_point(p, static_cast<double>(voxel_size)));
      ASSERT_NE(it, expected.end());
      EXPECT_LT((p - it->second).norm(), 1e-4f * voxel_size);  // two float sums in different order
    }
  }
}

}  // namespace
}  // namespace gpureg::test
