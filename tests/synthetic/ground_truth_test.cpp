// SPDX-License-Identifier: BSD-3-Clause
#include "data/ground_truth.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "data/random.hpp"
#include "gpureg/evaluation.hpp"
#include "scene.hpp"

namespace gpureg::test {
namespace {

using Eigen::Vector3f;

/// Squared distance to the nearest point, by trying them all.
float nearest_squared(const std::vector<Vector3f>& cloud, const Vector3f& query) {
  float best = 1e30f;
  for (const Vector3f& p : cloud) best = std::min(best, (p - query).squaredNorm());
  return best;
}

TEST(NeighbourGrid, AgreesWithBruteForce) {
  synthetic::Random random(7);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<Vector3f> cloud(static_cast<std::size_t>(random.between(1, 60)));
    const float span = random.uniform(0.01f, 2.0f);
    const auto any = [&] {
      return Vector3f(random.uniform(-span, span), random.uniform(-span, span),
                      random.uniform(-span, span));
    };
    for (Vector3f& p : cloud) p = any();
    const synthetic::NeighbourGrid grid(cloud, 0.1f);
    for (int k = 0; k < 300; ++k) {
      const Vector3f query = 1.2f * any();
      const float exact = nearest_squared(cloud, query);
      ASSERT_EQ(grid.any_within_radius(query), exact <= 0.1f * 0.1f) << exact;
    }
  }
}

TEST(NeighbourGrid, EmptyCloudHasNoNeighbours) {
  EXPECT_FALSE(synthetic::NeighbourGrid({}, 0.1f).any_within_radius({0, 0, 0}));
}

TEST(NeighbourGrid, QueriesFarAwayOrNotANumber) {
  const synthetic::NeighbourGrid grid({{0, 0, 0}}, 0.1f);
  EXPECT_TRUE(grid.any_within_radius({0.05f, 0, 0}));
  EXPECT_FALSE(grid.any_within_radius({1e8f, 0, 0}));
  EXPECT_FALSE(grid.any_within_radius({0, -1e30f, 0}));
}

TEST(GroundTruth, AgreesWithBruteForceOnAScene) {
  const TemporaryFolder folder;
  synthetic::GenerateOptions options = small_scene();
  options.frames_per_fragment = 15;  // far enough apart that overlaps differ
  synthetic::generate(folder.path(), options);
  const auto poses = read_poses(folder / "poses.txt");
  const evaluation::GroundTruth truth = evaluation::read_ground_truth(folder.path());
  std::vector<std::vector<Vector3f>> clouds;
  for (int i = 0; i < 3; ++i)
    clouds.push_back(read_cloud(folder / ("cloud_bin_" + std::to_string(i) + ".ply")));
  std::ifstream overlaps(folder / "gt_overlap.txt");

  const auto sampled_share = [&](std::size_t of, std::size_t in,
                                 const Eigen::Isometry3d& in_from_of, std::size_t stride) {
    std::size_t near = 0, tried = 0;
    for (std::size_t k = 0; k < clouds[of].size(); k += stride, ++tried) {
      near +=
          nearest_squared(clouds[in], in_from_of.cast<float>() * clouds[of][k]) <= 0.075f * 0.075f
              ? 1
              : 0;
    }
    return static_cast<double>(near) / static_cast<double>(tried);
  };
  double high = 0, low = 0;
  for (int i, j; overlaps >> i >> j >> high >> low;) {
    const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
    const Eigen::Isometry3d i_from_j = poses[a].inverse() * poses[b];
    // All of j's points for the exact counts; a sample is enough for the other direction.
    const double of_j = sampled_share(b, a, i_from_j, 1),
                 of_i = sampled_share(a, b, i_from_j.inverse(), 11);
    const double other = std::abs(of_j - high) < std::abs(of_j - low) ? low : high;
    EXPECT_NEAR(std::min(std::abs(of_j - high), std::abs(of_j - low)), 0, 2e-4)
        << "poses.txt and gt_overlap.txt are rounded";
    EXPECT_NEAR(of_i, other, 0.04)
        << "a sample of more than 300 points: twice its standard error or more";

    const auto same = [&](const auto& entry) { return entry.i == i && entry.j == j; };
    const auto in_all = std::find_if(truth.all_log.begin(), truth.all_log.end(), same);
    const auto in_gt = std::find_if(truth.log.begin(), truth.log.end(), same);
    EXPECT_EQ(in_all != truth.all_log.end(), high >= 0.05);
    EXPECT_EQ(in_gt != truth.log.end(), high >= 0.3);
    ASSERT_NE(in_all, truth.all_log.end());
    EXPECT_LT((in_all->transform - i_from_j.matrix()).norm(), 1e-7);
    const auto& information =
        std::find_if(truth.all_information.begin(), truth.all_information.end(), same)->information;
    EXPECT_NEAR(information(0, 0), of_j * static_cast<double>(clouds[b].size()), 3)
        << "points at exactly 7.5 cm, files are rounded";
  }
}

TEST(GroundTruth, InformationIsRedwoodsSum) {
  synthetic::Random random(3);
  std::vector<synthetic::Fragment> fragments(2);
  for (int k = 0; k < 200; ++k)
    fragments[0].points.push_back(
        {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
  fragments[1].world_from_fragment = Eigen::Translation3d(0.3, -0.2, 1.0) *
                                     Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized());
  for (const Vector3f& p : fragments[0].points) {
    fragments[1].points.push_back(fragments[1].world_from_fragment.inverse().cast<float>() * p);
  }
  const std::vector<synthetic::NeighbourGrid> grids{{fragments[0].points, 0.01f},
                                                    {fragments[1].points, 0.01f}};
  const synthetic::PairTruth truth = synthetic::pair_truth(fragments, grids, 0, 1);
  EXPECT_EQ(truth.share_of_i, 1.0);
  EXPECT_EQ(truth.share_of_j, 1.0);
  Eigen::Matrix<double, 6, 6> expected = Eigen::Matrix<double, 6, 6>::Zero();
  for (const Vector3f& point : fragments[1].points) {
    const Eigen::Vector3d p = point.cast<double>();
    Eigen::Matrix<double, 3, 6> a;
    a << 1, 0, 0, 0, 2 * p.z(), -2 * p.y(), 0, 1, 0, -2 * p.z(), 0, 2 * p.x(), 0, 0, 1, 2 * p.y(),
        -2 * p.x(), 0;
    expected += a.transpose() * a;
  }
  EXPECT_LT((truth.information - expected).norm(), 1e-9 * expected.norm());
}

}  // namespace
}  // namespace gpureg::test
