// SPDX-License-Identifier: BSD-3-Clause
#include "scale/consensus.hpp"

#include <gtest/gtest.h>

#include <random>

#include "scale/ladder.hpp"
#include "support/scan.hpp"

namespace gpureg::scale {
namespace {

Vec3 vec(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// One of `wrong` + 1 matches obeys the similarity.
Matches matches_of(double factor, std::size_t count, std::size_t wrong) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-2, 2);
  std::normal_distribution<double> normal;
  const Eigen::Isometry3d pose = test::random_pose(random);
  Matches out;
  for (std::size_t k = 0; k < count; ++k) {
    const Eigen::Vector3d p(place(random), place(random), place(random)),
        other(place(random), place(random), place(random)),
        m = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    const bool right = k % (wrong + 1) == 0;
    out.p.push_back(vec(p));
    out.m.push_back(vec(m));
    out.q.push_back(vec(pose * (factor * (right ? p : other))));
    out.n.push_back(vec(pose.linear() * (right ? m : other.normalized())));
  }
  return out;
}

TEST(Consensus, FindsTheFactorAmongWrongMatches) {
  for (const double factor : {0.88, 1.0, 1.13}) {
    const std::vector<Proposal> found = propose_factors(matches_of(factor, 1500, 9), 0.05f, 1);
    ASSERT_FALSE(found.empty());
    EXPECT_NEAR(found[0].factor, factor, 0.005);
    EXPECT_GT(found[0].places, 100u);
  }
}

TEST(Consensus, OfWrongMatchesHasLittleSupport) {
  Matches wrong = matches_of(1, 1500, 1499);
  for (const Proposal& p : propose_factors(wrong, 0.05f, 1)) EXPECT_LT(p.places, 30u);
  EXPECT_TRUE(propose_factors(Matches(), 0.05f, 1).empty());
}

TEST(ScaleLadder, CoversWhatCanBeCompared) {
  std::mt19937 random(2);
  std::vector<Eigen::Vector3f> points = test::scan_room(random);
  const std::vector<double> free = ladder_of(PointCloudView(points), {}, 0.05f);
  ASSERT_GT(free.size(), 8u);
  EXPECT_LT(free.size(), 30u);
  EXPECT_LT(free.front(), 0.3);
  EXPECT_GT(free.back(), 1.4);
  for (std::size_t k = 1; k < free.size(); ++k) EXPECT_NEAR(free[k] / free[k - 1], kStep, 1e-9);
  // In another unit the rungs are other powers of the same step.
  for (Eigen::Vector3f& p : points) p *= 1000;
  const std::vector<double> millimetres = ladder_of(PointCloudView(points), {}, 0.05f);
  EXPECT_NEAR(static_cast<double>(millimetres.size()), static_cast<double>(free.size()), 1);
  EXPECT_LT(millimetres.back(), 0.01);
  const std::vector<double> narrow = ladder_of(PointCloudView(points), {0.0009, 0.0012}, 0.05f);
  EXPECT_LE(narrow.size(), 3u);
  EXPECT_GE(narrow.size(), 1u);
  EXPECT_TRUE(ladder_of(PointCloudView(), {}, 0.05f).empty());
}

}  // namespace
}  // namespace gpureg::scale
