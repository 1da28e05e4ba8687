// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "api/with_settings.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg::cpu {
namespace {

TEST(Refine, FindsTheWayBackAndNeverGetsWorse) {
  std::mt19937 random(1);
  Exec exec(2);
  PrepareSettings options;
  const auto cloud =
      test::prepare_one(exec, test::raw_cloud(test::bumpy_sheet(random, 30000, 2.0f)), options);
  const PairView pair = test::pair_view(*cloud, *cloud);
  const RegistrationSettings registration;
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<BestPose> start(1);
    start[0].found = true;
    // About 1 degree and 2 cm off.
    const double omega[3] = {0.01 * normal(random), 0.01 * normal(random), 0.01 * normal(random)};
    const double shift[3] = {0.01 * normal(random), 0.01 * normal(random), 0.01 * normal(random)};
    start[0].pose = compose_small(omega, shift, identity_pose<double>());
    start[0].support =
        measure_support(pair.source, pair.target, to_rigid(start[0].pose), registration);
    const BestPose found = refine_poses(exec, {&pair, 1}, start, registration)[0];
    EXPECT_LE(truncated_cost(found.support, pair.source.size),
              truncated_cost(start[0].support, pair.source.size));
    // The cloud on itself: the truth is the identity, reached to the stopping limit (a thousandth
    // of 7.5 cm) and some.
    EXPECT_LT(std::sqrt(found.pose.tx * found.pose.tx + found.pose.ty * found.pose.ty +
                        found.pose.tz * found.pose.tz),
              1e-3);
    EXPECT_GT(std::fabs(found.pose.w), 1 - 1e-6);
    for (const unsigned threads : {1u, 7u}) {
      Exec pool(threads);
      const BestPose again = refine_poses(pool, {&pair, 1}, start, registration)[0];
      EXPECT_EQ(again.pose.w, found.pose.w);
      EXPECT_EQ(again.pose.tx, found.pose.tx);
      EXPECT_EQ(again.iterations, found.iterations);
    }
  }
}

TEST(Refine, OffOrWithoutAPoseChangesNothing) {
  std::mt19937 random(2);
  Exec exec(1);
  const auto cloud =
      test::prepare_one(exec, test::raw_cloud(test::cube(random, 100, 1)), PrepareSettings{});
  const PairView pair = test::pair_view(*cloud, *cloud);
  RegistrationSettings off;
  off.refine.max_iterations = 0;
  std::vector<BestPose> start(1);
  EXPECT_FALSE(refine_poses(exec, {&pair, 1}, start, resolve(RegistrationOptions{}))[0].found);
  start[0].found = true;
  start[0].pose.tx = 0.3;
  EXPECT_EQ(refine_poses(exec, {&pair, 1}, start, off)[0].pose.tx, 0.3);
}

}  // namespace
}  // namespace gpureg::cpu
