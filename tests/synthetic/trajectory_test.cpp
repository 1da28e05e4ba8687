// SPDX-License-Identifier: BSD-3-Clause
#include "data/tours/trajectory.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "data/tours/tour.hpp"
#include "gpureg/error.hpp"

namespace gpureg::test {
namespace {

TEST(Trajectory, IsSmoothAndStaysInTheHouse) {
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const synthetic::House house = synthetic::build_house(seed);
    const synthetic::RayScene scene(house.mesh);
    const auto poses = synthetic::walk(house, scene, seed, 1500);
    ASSERT_EQ(poses.size(), 1500u);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const Eigen::Vector2f p = poses[k].translation().head<2>().cast<float>();
      bool inside = false;
      for (const synthetic::Room& room : house.rooms) {
        inside = inside || ((p.array() > room.floor.low.array() - 0.15f).all() &&
                            (p.array() < room.floor.high.array() + 0.15f).all());
      }
      ASSERT_TRUE(inside) << "seed " << seed << " frame " << k;
      if (k == 0) continue;
      const Eigen::Isometry3d motion = poses[k - 1].inverse() * poses[k];
      ASSERT_LT(motion.translation().norm(), 0.04) << "seed " << seed << " frame " << k;  // 1.2 m/s
      ASSERT_LT(Eigen::AngleAxisd(motion.rotation()).angle(), 0.12)
          << "seed " << seed << " frame " << k;
    }
  }
}

TEST(Trajectory, ComesBackToOtherRoomsAndPlaces) {
  const synthetic::House house = synthetic::build_house(4);
  const synthetic::RayScene scene(house.mesh);
  const auto poses = synthetic::walk(house, scene, 4, 3000);
  std::vector<bool> seen(house.rooms.size(), false);
  int returns = 0;
  for (std::size_t k = 0; k < poses.size(); k += 50) {
    const Eigen::Vector3d p = poses[k].translation();
    for (std::size_t r = 0; r < house.rooms.size(); ++r) {
      const synthetic::Rect& floor = house.rooms[r].floor;
      if (p.x() > floor.low.x() && p.x() < floor.high.x() && p.y() > floor.low.y() &&
          p.y() < floor.high.y())
        seen[r] = true;
    }
    for (std::size_t j = 0; j + 300 < k; j += 50)
      returns += (poses[j].translation() - p).norm() < 0.7 ? 1 : 0;
  }
  EXPECT_GE(std::count(seen.begin(), seen.end(), true), 3);
  EXPECT_GT(returns, 5);
}

TEST(Trajectory, StaysAwayForAsLongAsAsked) {
  const synthetic::House house = synthetic::build_house(11);
  const synthetic::RayScene scene(house.mesh);
  const auto usual = synthetic::tour(house, scene, 11, 60),
             away = synthetic::tour(house, scene, 11, 60, 30);
  EXPECT_LT(synthetic::first_return(usual), 30) << "otherwise this tests nothing";
  EXPECT_GE(synthetic::first_return(away), 30);
  EXPECT_LT(synthetic::first_return(away), 60) << "it does come back";
  EXPECT_THROW(synthetic::tour(house, scene, 11, 60, 900), InvalidArgument);
}

TEST(Trajectory, FirstReturn) {
  std::vector<Eigen::Vector2f> line;  // 10 m there, 1 m aside, and back
  for (int k = 0; k < 500; ++k) line.emplace_back(0.02f * static_cast<float>(k), 0);
  for (int k = 0; k < 50; ++k) line.emplace_back(10, 0.02f * static_cast<float>(k));
  for (int k = 0; k < 500; ++k) line.emplace_back(10 - 0.02f * static_cast<float>(k), 1);
  // At x on the way back it has walked 21 - x, and is within sqrt(1.2^2 - 1) = 0.66 m of the places
  // that it left up to 21 - 2 x + 0.66 m earlier: 6 m at x = 7.83, after 13.17 m.
  EXPECT_NEAR(synthetic::first_return(line), 13.17, 0.2);
  line.resize(600);
  EXPECT_NEAR(synthetic::first_return(line), 12, 1e-3) << "never: the whole length";
}

TEST(Trajectory, ShortWalksBeginLongOnes) {
  const synthetic::House house = synthetic::build_house(2);
  const synthetic::RayScene scene(house.mesh);
  const auto few = synthetic::walk(house, scene, 2, 40),
             many = synthetic::walk(house, scene, 2, 900);
  for (std::size_t k = 0; k < few.size(); ++k) ASSERT_EQ(few[k].matrix(), many[k].matrix()) << k;
}

}  // namespace
}  // namespace gpureg::test
