// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "localization/building.hpp"

namespace gpureg::test {
namespace {

// Sampled at random, a surface of 10 cm voxels is known to about a centimetre.
constexpr double kClose = 0.05;

TEST(Locate, FindsAScanInItsRoomAndSaysWhereItIsNot) {
  const PreparedMap map = building({1, 2, 3, 4}, map_options());
  EXPECT_EQ(map.tiles(), 1u);
  for (const unsigned room : {2u, 4u}) {
    const Query query(room, room - 1, room);
    const LocateResult result = locate(context(), query.scan.view(), map);
    EXPECT_EQ(result.status, LocateStatus::found) << result.absent_probability;
    ASSERT_FALSE(result.poses.empty());
    EXPECT_LT(query.error(result.poses.front()), kClose);
    EXPECT_LT(result.absent_probability, 0.1);
    double sum = result.absent_probability;
    for (const LocatedPose& pose : result.poses) sum += pose.confidence;
    EXPECT_NEAR(sum, 1, 1e-12);  // rounding of a few additions
  }
  const Query foreign(77, 0, 9);
  const LocateResult nowhere = locate(context(), foreign.scan.view(), map);
  EXPECT_EQ(nowhere.status, LocateStatus::not_found);
  EXPECT_GT(nowhere.absent_probability, 0.5);
}

// Compared with the other sides of its surfaces, a map supports no place.
TEST(Locate, AMapWithoutSidesIsComparedByThoseThatItInfers) {
  PointCloud cloud;
  for (const unsigned room : {1u, 2u, 3u})
    for (const Eigen::Vector3f& p : moved(map_from_room(room - 1), furnished_room(room, room)))
      cloud.points.push_back(p);
  const PreparedMap map = localization::prepare_map(cloud.view(), map_options());
  for (const unsigned room : {1u, 2u, 3u}) {
    const Query query(room, room - 1, room + 7);
    const LocateResult result = locate(context(), query.scan.view(), map);
    ASSERT_EQ(result.status, LocateStatus::found);
    const PoseEvidence& e = result.poses.front().verification.evidence;
    EXPECT_GT(e.source_overlap, 0.7 * e.source_overlap_any_normal);
  }
}

TEST(Locate, WhatTheMapLacksCostsConfidence) {
  const PreparedMap map = building({1, 2, 3}, map_options());
  Query query(2, 1, 2);
  const double whole = locate(context(), query.scan.view(), map).poses.front().confidence;
  // Beyond a wall the scan sees a room that the map has not.
  const Eigen::Isometry3d beyond = query.map_from_scan.inverse() * Eigen::Translation3d(6, 5, 0);
  for (const Eigen::Vector3f& p : moved(beyond, furnished_room(50, 2)))
    query.scan.points.push_back(p);
  const LocateResult result = locate(context(), query.scan.view(), map);
  ASSERT_FALSE(result.poses.empty());
  EXPECT_LT(query.error(result.poses.front()), kClose);
  EXPECT_LT(result.poses.front().verification.evidence.source_overlap_any_normal, 0.6);
  EXPECT_LT(result.poses.front().confidence, whole - 0.01);
}

TEST(Locate, FindsAScanAmongTiles) {
  const PreparedMap map = building({1, 2, 3, 4, 5, 6}, map_options(4));
  EXPECT_GE(map.tiles(), 3u);
  const Query query(5, 4, 3);
  const LocateResult result = locate(context(), query.scan.view(), map);
  EXPECT_EQ(result.stage, SearchStage::from_above) << "the plan is enough";
  EXPECT_EQ(result.status, LocateStatus::found);
  ASSERT_FALSE(result.poses.empty());
  EXPECT_LT(query.error(result.poses.front()), kClose);
}

TEST(Locate, MoreConfidenceThanUsualTakesTheWholeSearch) {
  const PreparedMap map = building({1, 2, 3}, map_options());
  const Query query(2, 1, 1);
  LocateOptions options = LocateOptions{RegistrationOptions{kVoxel}};
  const LocateResult usual = locate(context(), {query.scan.view()}, map, options).front();
  EXPECT_EQ(usual.status, LocateStatus::found);
  EXPECT_EQ(usual.stage, SearchStage::from_above);
  options.min_confidence = 1;
  const LocateResult result = locate(context(), {query.scan.view()}, map, options).front();
  EXPECT_EQ(result.status, LocateStatus::not_found);
  EXPECT_NE(result.stage, SearchStage::from_above);
  EXPECT_GT(result.tiles, 0u);
  ASSERT_FALSE(result.poses.empty());
  EXPECT_LT(query.error(result.poses.front()), kClose);
}

TEST(Locate, FindsTheSamePlaceInVoxelsOfAnyWidth) {
  const PreparedMap map = building({1, 2, 3}, map_options(5));
  const Query query(2, 1, 1);
  for (const double factor : {1.0, 1.5, 2.0}) {
    LocateOptions options = LocateOptions{RegistrationOptions{kVoxel}};
    options.coarse_factor = factor;
    const LocateResult result = locate(context(), {query.scan.view()}, map, options).front();
    ASSERT_EQ(result.status, LocateStatus::found) << factor;
    EXPECT_LT(query.error(result.poses.front()), kClose) << factor;
  }
}

TEST(Locate, ACopiedRoomIsAnAliasUntilSomebodySaysRoughlyWhere) {
  const PreparedMap map = building({1, 2, 1}, map_options());
  const Query query(1, 2, 5);
  const LocateResult result = locate(context(), query.scan.view(), map);
  EXPECT_EQ(result.status, LocateStatus::ambiguous);
  ASSERT_GE(result.poses.size(), 2u);
  EXPECT_TRUE(result.poses[1].alias);
  EXPECT_FALSE(result.poses[0].alias);
  EXPECT_LT(std::min(query.error(result.poses[0]), query.error(result.poses[1])), kClose);

  LocatePrior prior;
  prior.position = localization::PositionPrior{query.map_from_scan.translation(), 2};
  const LocateResult near = locate(context(), query.scan.view(), map, prior);
  EXPECT_EQ(near.status, LocateStatus::found);
  ASSERT_FALSE(near.poses.empty());
  EXPECT_LT(query.error(near.poses.front()), kClose);
  for (const LocatedPose& pose : near.poses)
    EXPECT_LE((pose.map_from_scan.translation() - prior.position->position).norm(), 2);
}

TEST(Locate, GravityThatContradictsLeavesNothing) {
  const PreparedMap map = building({1, 2}, map_options());
  const Query query(2, 1, 6);
  LocatePrior prior;
  prior.gravity = GravityPrior{query.map_from_scan.linear().transpose() * Eigen::Vector3d::UnitZ(),
                               Eigen::Vector3d::UnitZ(), 5};
  EXPECT_EQ(locate(context(), query.scan.view(), map, prior).status, LocateStatus::found);
  prior.gravity->target_up = Eigen::Vector3d::UnitX();
  EXPECT_NE(locate(context(), query.scan.view(), map, prior).status, LocateStatus::found);
}

TEST(Locate, LargeCoordinates) {
  MapBuilder builder(map_options());
  const Eigen::Vector3d far(450000, 5411000, 300);
  PointCloud cloud = seen_room(1, 1, Eigen::Isometry3d::Identity());
  cloud.origin = far;
  builder.add_cloud(cloud.view());
  const PreparedMap map = builder.build();
  const Query query(1, 0, 4);
  const LocateResult result = locate(context(), query.scan.view(), map);
  ASSERT_EQ(result.status, LocateStatus::found);
  LocatedPose pose = result.poses.front();
  pose.map_from_scan.translation() -= far;
  EXPECT_LT(query.error(pose), kClose);
}

}  // namespace
}  // namespace gpureg::test
