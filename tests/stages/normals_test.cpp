// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "api/with_settings.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg::cpu {
namespace {

std::vector<Vec3> normals_of(Exec& exec, const RawCloud& raw, const PrepareSettings& options) {
  return test::prepare_one(exec, raw, options)->normals;
}

TEST(Normals, AgreeWithDoubleOverAllNeighbours) {
  std::mt19937 random(1);
  Exec exec(2);
  PrepareSettings options;
  int compared = 0;
  for (int trial = 0; trial < 10; ++trial) {
    const std::vector<Vec3> points = test::bumpy_sheet(random, 20000, 2.5f);
    const auto cloud = test::prepare_one(exec, test::raw_cloud(points), options);
    for (std::size_t i = 0; i < cloud->points.size(); i += 3) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      std::vector<Eigen::Vector3d> near;
      for (const Vec3& q : cloud->points)
        if (squared_norm(q - cloud->points[i]) <= options.normal_radius * options.normal_radius) {
          near.emplace_back(q.x, q.y, q.z);
          mean += near.back();
        }
      if (near.size() < 3) {
        EXPECT_TRUE(is_zero(cloud->normals[i]));
        continue;
      }
      mean /= static_cast<double>(near.size());
      Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
      for (const Eigen::Vector3d& q : near) covariance += (q - mean) * (q - mean).transpose();
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
      // Where two eigenvalues nearly meet the normal is not determined.
      if (solver.eigenvalues()(1) - solver.eigenvalues()(0) < 1e-2 * solver.eigenvalues()(2))
        continue;
      const Eigen::Vector3d n(cloud->normals[i].x, cloud->normals[i].y, cloud->normals[i].z);
      EXPECT_GT(std::fabs(n.dot(solver.eigenvectors().col(0))), 1 - 1e-6);  // 0.08 degrees
      ++compared;
    }
  }
  EXPECT_GT(compared, 3000);
}

TEST(Normals, PointAtTheNearestViewpoint) {
  std::vector<Vec3> points;
  for (int x = 0; x < 40; ++x)
    for (int y = 0; y < 40; ++y)
      points.push_back({0.05f * static_cast<float>(x), 0.05f * static_cast<float>(y), 1});
  RawCloud raw = test::raw_cloud(points);
  const std::vector<Vec3> viewpoints = {{1, 1, 3}, {50, 50, -50}};
  raw.viewpoints = &viewpoints[0].x;
  raw.viewpoint_count = 2;
  Exec exec(1);
  PrepareSettings options;
  options.voxel_size = 0;
  for (const Vec3& n : normals_of(exec, raw, options)) EXPECT_GT(n.z, 0.999f);
  raw.viewpoints = nullptr;
  raw.viewpoint_count = 0;
  // the origin sees it from below
  for (const Vec3& n : normals_of(exec, raw, options)) EXPECT_LT(n.z, -0.999f);
  const std::vector<Vec3> up(points.size(), Vec3{0, 0, 1});
  raw.normals = &up[0].x;
  // the input's own side wins
  for (const Vec3& n : normals_of(exec, raw, options)) EXPECT_GT(n.z, 0.999f);
}

// Two by two metres of floor; some of the input's normals, those of the first rows, point down.
// Returns how many prepared ones do.
int downward(std::size_t wrong_rows, const std::vector<Vec3>& viewpoints,
             std::uint32_t depth_maps = 10) {
  std::vector<Vec3> points, normals;
  for (std::size_t x = 0; x < 40; ++x)
    for (std::size_t y = 0; y < 40; ++y) {
      points.push_back({0.05f * static_cast<float>(x), 0.05f * static_cast<float>(y), 0});
      normals.push_back({0, 0, x < wrong_rows ? -1.0f : 1.0f});
    }
  RawCloud raw = test::raw_cloud(points);
  raw.normals = &normals[0].x;
  if (!viewpoints.empty()) {
    raw.viewpoints = &viewpoints[0].x;
    raw.viewpoint_count = viewpoints.size();
  }
  Exec exec(2);
  PrepareSettings options;
  options.voxel_size = 0;
  options.depth_maps = depth_maps;
  int down = 0;
  for (const Vec3& n : normals_of(exec, raw, options)) down += n.z < 0;
  return down;
}

TEST(Normals, InputNormalsFacingAwayAreFlipped) {
  EXPECT_EQ(downward(5, {}), 200);                       // nothing is known
  EXPECT_EQ(downward(5, {{1, 1, 2}}), 0);                // an eighth of the floor
  EXPECT_EQ(downward(5, {{1, 1, 2}, {0, 0, -1}}), 200);  // one viewpoint is below the floor
  // so many: the viewpoint is wrong
  EXPECT_EQ(downward(6, {{1, 1, 2}}), 240);
  EXPECT_EQ(downward(40, {{1, 1, 2}}), 1600);
  // as in LoopSmart: no viewpoints are used
  EXPECT_EQ(downward(5, {{1, 1, 2}}, 0), 200);
  // seen at six degrees: noise could have tilted them so far
  EXPECT_EQ(downward(5, {{-20, 1, 2}}), 200);
}

TEST(Normals, NoneOnALineOrForLonePoints) {
  std::vector<Vec3> line;
  for (int k = 0; k < 100; ++k)
    line.push_back({0.01f * static_cast<float>(k), 0.02f * static_cast<float>(k), 0});
  line.push_back({9, 9, 9});
  Exec exec(1);
  PrepareSettings options;
  options.voxel_size = 0;
  for (const Vec3& n : normals_of(exec, test::raw_cloud(line), options)) EXPECT_TRUE(is_zero(n));
}

}  // namespace
}  // namespace gpureg::cpu
