// SPDX-License-Identifier: BSD-3-Clause
#include "localization/plan/plan_search.hpp"

#include <gtest/gtest.h>

#include "localization/building.hpp"
#include "localization/plan/floor_plan.hpp"
#include "localization/verify_places.hpp"

namespace gpureg::test {
namespace {

using localization::Axis;
using localization::Candidate;
using localization::FloorPlan;
using localization::MapState;
using localization::Scan;

/// A place of the plan is off by a cell, of two voxels.
constexpr double kOfCell = 0.3;

Scan scan_of(const PointCloud& cloud, const MapState& map, const LocatePrior& prior = {}) {
  return localization::scan_of(prepare_batch(context(), {cloud.view()}, map.options.prepare)[0],
                               prior);
}

std::vector<Candidate> places_of(const Scan& scan, const PreparedMap& map,
                                 const Context& on = context()) {
  std::vector<Scan> scans{scan};
  search_plan(on, MapState::of(map), 8, localization::kUsualEffort, {scans.data()});
  return scans[0].planned;
}

double error(const Query& query, const Candidate& place) {
  LocatedPose pose;
  pose.map_from_scan = place.map_from_scan;
  return query.error(pose);
}

TEST(FrequentAxes, AreThoseOfTheNormalsUpToTheSign) {
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 0.03f);
  std::vector<Eigen::Vector3f> normals;
  const auto add = [&](const Eigen::Vector3f& direction, int count) {
    for (int k = 0; k < count; ++k)
      normals.push_back(
          (direction + Eigen::Vector3f(noise(random), noise(random), noise(random))).normalized());
  };
  const Eigen::Vector3f up = Eigen::Vector3f(1, 2, 2).normalized();
  const Eigen::Vector3f wall = Eigen::Vector3f(2, 1, -2).normalized();
  add(up, 300);
  add(-up, 500);
  add(wall, 400);
  add(up.cross(wall), 100);
  normals.push_back(Eigen::Vector3f::Zero());  // not known
  const std::vector<Axis> axes = localization::frequent_axes(normals, 2);
  ASSERT_EQ(axes.size(), 2u);
  EXPECT_GT(axes[0].direction.dot(-up), 0.999f);
  EXPECT_GT(axes[1].direction.dot(wall), 0.999f);
  EXPECT_GT(axes[0].facing, axes[0].opposite);
  EXPECT_GT(2 * axes[0].opposite, axes[0].facing);
  EXPECT_EQ(axes[1].opposite, 0u);
  EXPECT_TRUE(localization::frequent_axes({}, 3).empty());
}

TEST(FrequentAxes, AreTurnedUpright) {
  std::mt19937 random(4);
  for (int k = 0; k < 20; ++k) {
    const Eigen::Vector3f axis =
        random_pose(random).linear().cast<float>() * Eigen::Vector3f::UnitZ();
    const Eigen::Matrix3f turn = localization::upright(axis);
    EXPECT_TRUE((turn * axis).isApprox(Eigen::Vector3f::UnitZ(), 1e-5f));
    EXPECT_NEAR(turn.determinant(), 1, 1e-5f);
    EXPECT_TRUE((turn * turn.transpose()).isApprox(Eigen::Matrix3f::Identity(), 1e-5f));
  }
}

TEST(FloorPlan, WallsFaceTheSensor) {
  const PreparedMap map = building({1}, map_options());
  const FloorPlan& plan = MapState::of(map).plan(2);
  EXPECT_TRUE(plan.has_sides);
  ASSERT_GT(plan.width, 0);
  // Two surfaces that meet at the origin; the axis of one room may be that of either.
  const bool is_along_y = std::abs((plan.turn * Eigen::Vector3f::UnitY())[2]) > 0.5f;
  const Eigen::Vector3f place =
      is_along_y ? Eigen::Vector3f(0.05f, 1, 1) : Eigen::Vector3f(2, 0.05f, 1);
  const Eigen::Vector3f at =
      (plan.turn * (place - MapState::of(map).origin.cast<float>()) - plan.corner) / plan.cell;
  const std::uint32_t bits = plan.walls_of(static_cast<int>(at[0]), static_cast<int>(at[1]));
  const Eigen::Vector3f facing =
      plan.turn * (is_along_y ? Eigen::Vector3f::UnitX() : Eigen::Vector3f::UnitY());
  EXPECT_NE(bits & localization::facing::of(facing, true), 0u);
  EXPECT_EQ(bits & localization::facing::of(-facing, true), 0u);
}

TEST(FloorPlan, MergesTilesOnAnyNumberOfThreads) {
  MapBuilder builder(map_options(5));
  builder.add_scan(context(), seen_room(1, 1, Eigen::Isometry3d::Identity()).view(),
                   UnalignedIsometry3d::Identity());
  PointCloud floor;  // wide enough for several bands of rows
  for (int k = 0; k < 300 * 300; ++k) {
    floor.points.emplace_back(0.05f * static_cast<float>(k % 300),
                              0.05f * static_cast<float>(k / 300), -0.5f);
    floor.normals.push_back(Eigen::Vector3f::UnitZ());
  }
  builder.add_cloud(floor.view());
  const PreparedMap map = builder.build();
  ASSERT_GT(map.tiles(), 1u);
  const FloorPlan one(MapState::of(map), 1), many(MapState::of(map), 3);
  ASSERT_GT(one.height, 64);
  EXPECT_EQ(one.walls, many.walls);
  EXPECT_EQ(one.coarse, many.coarse);
  EXPECT_EQ(one.column_begin, many.column_begin);
  EXPECT_EQ(one.columns, many.columns);
  // A cell has each height once, and the walls of its column.
  constexpr int kBits = localization::facing::kBits;
  std::size_t cell = 0;
  for (int y = 0; y < one.height; ++y)
    for (int x = 0; x < one.width; ++x, ++cell) {
      std::uint32_t faces = 0;
      for (std::uint32_t k = one.column_begin[cell]; k < one.column_begin[cell + 1]; ++k) {
        faces |= one.columns[k];
        if (k > one.column_begin[cell])
          ASSERT_LT(one.columns[k - 1] >> kBits, one.columns[k] >> kBits);
      }
      ASSERT_EQ(one.walls_of(x, y), faces & localization::facing::kWalls);
    }
  EXPECT_EQ(one.column_begin[cell], one.columns.size());
}

TEST(VerifyPlanned, RefinesFromOtherHeights) {
  const PreparedMap map = building({1, 2, 3}, map_options());
  const MapState& state = MapState::of(map);
  const Query query(2, 1, 7);
  Scan scan = scan_of(query.scan, state);
  const Eigen::Vector3d up = state.plan(2).turn.row(2).cast<double>();
  // Farther than the correspondences of a refinement, 1.5 voxels, reach.
  for (const double voxels : {-3.5, 3.5}) {
    Candidate candidate;
    candidate.map_from_scan = UnalignedIsometry3d(query.map_from_scan);
    candidate.map_from_scan.translation() += voxels * static_cast<double>(kVoxel) * up;
    candidate.confidence = 0.5;
    scan.candidates = {candidate};
    const auto places = verify_planned(
        context(), state, localization::resolve(LocateOptions{RegistrationOptions{kVoxel}}), 0,
        {&scan});
    ASSERT_EQ(places.at(0).size(), 1u);
    LocatedPose pose;
    pose.map_from_scan = places[0][0].verification.target_from_source;
    EXPECT_LT(query.error(pose), 0.02) << voxels;
  }
}

TEST(PlanSearch, FindsScansOfAnyAttitude) {
  const PreparedMap map = building({1, 2, 3, 4, 5, 6, 7, 8, 9}, map_options());
  const Query foreign(77, 0, 9);
  const auto elsewhere = places_of(scan_of(foreign.scan, MapState::of(map)), map);
  ASSERT_FALSE(elsewhere.empty());
  EXPECT_LT(elsewhere[0].confidence, 0.3);
  for (unsigned room = 1; room <= 9; ++room) {
    const Query query(room, room - 1, 20 + room);
    const std::vector<Candidate> places = places_of(scan_of(query.scan, MapState::of(map)), map);
    ASSERT_FALSE(places.empty());
    EXPECT_LT(error(query, places[0]), kOfCell) << room;
    EXPECT_GT(places[0].confidence, elsewhere[0].confidence) << room;
    EXPECT_GT(places[0].agreeing, elsewhere[0].agreeing) << room;
  }
}

TEST(PlanSearch, TheAxisIsThatOfTheMap) {
  std::mt19937 random(5);
  const Eigen::Isometry3d turned = random_pose(random);
  MapBuilder builder(map_options());
  for (const unsigned room : {1u, 2u, 3u})
    builder.add_scan(context(), seen_room(room, room, Eigen::Isometry3d::Identity()).view(),
                     UnalignedIsometry3d(turned * map_from_room(room - 1)));
  const PreparedMap map = builder.build();
  Query query(2, 1, 7);
  query.map_from_scan = turned * query.map_from_scan;
  const auto places = places_of(scan_of(query.scan, MapState::of(map)), map);
  ASSERT_FALSE(places.empty());
  EXPECT_LT(error(query, places[0]), kOfCell);
}

TEST(PlanSearch, SidesThatNobodyKnowsAreBothTried) {
  Query query(2, 1, 8);
  const PreparedMap known = building({1, 2, 3}, map_options());
  PointCloud unknown;  // without normals and viewpoints
  unknown.points = known.cloud().points;
  unknown.origin = known.cloud().origin;
  const PreparedMap map = prepare_map(unknown.view(), map_options());
  auto scan = query.scan;
  scan.viewpoints.clear();
  PointCloudView view = scan.view();
  view.infer_viewpoint = false;
  for (const PreparedMap& each : {known, map}) {
    const MapState& state = MapState::of(each);
    const Scan of_view =
        localization::scan_of(prepare_batch(context(), {view}, state.options.prepare)[0], {});
    const auto places = places_of(of_view, each);
    ASSERT_FALSE(places.empty());
    EXPECT_LT(error(query, places[0]), kOfCell);
  }
}

TEST(PlanSearch, HeightsFollowFromColumns) {
  MapBuilder builder(map_options());
  for (const unsigned room : {1u, 2u, 3u, 4u}) {
    UnalignedIsometry3d pose = UnalignedIsometry3d::Identity();
    pose.translation().z() = 3.0 * room;
    builder.add_scan(context(), seen_room(room, room, Eigen::Isometry3d::Identity()).view(), pose);
  }
  const PreparedMap map = builder.build();
  Query query(3, 0, 11);
  query.map_from_scan = Eigen::Translation3d(0, 0, 9) * query.map_from_scan;
  const auto places = places_of(scan_of(query.scan, MapState::of(map)), map);
  ASSERT_FALSE(places.empty());
  EXPECT_LT(error(query, places[0]), kOfCell);
}

TEST(PlanSearch, SaysNothingThatThePriorExcludes) {
  const PreparedMap map = building({1, 2, 1}, map_options());
  const Query query(1, 2, 5);
  LocatePrior prior;
  const auto all = places_of(scan_of(query.scan, MapState::of(map), prior), map);
  ASSERT_GE(all.size(), 2u);
  EXPECT_LT(all[0].confidence, 0.5) << "the copy is a rival";
  prior.position = localization::PositionPrior{query.map_from_scan.translation(), 2};
  const auto near = places_of(scan_of(query.scan, MapState::of(map), prior), map);
  ASSERT_FALSE(near.empty());
  EXPECT_LT(error(query, near[0]), kOfCell);
  for (const Candidate& place : near)
    EXPECT_LE((place.map_from_scan.translation() - prior.position->position).norm(), 2);
  prior.position->position.x() += 1000;
  EXPECT_TRUE(places_of(scan_of(query.scan, MapState::of(map), prior), map).empty());
  prior.position.reset();
  prior.gravity = GravityPrior{query.map_from_scan.linear().transpose() * Eigen::Vector3d::UnitZ(),
                               Eigen::Vector3d::UnitX(), 5};
  for (const Candidate& place : places_of(scan_of(query.scan, MapState::of(map), prior), map))
    EXPECT_GT((place.map_from_scan.linear() * prior.gravity->source_up).x(), 0.996);
}

TEST(PlanSearch, MapsAndScansWithoutWallsHaveNoPlaces) {
  MapBuilder far(map_options());
  PointCloud cloud = seen_room(1, 1, Eigen::Isometry3d::Identity());
  far.add_scan(context(), cloud.view(), UnalignedIsometry3d::Identity());
  UnalignedIsometry3d away = UnalignedIsometry3d::Identity();
  away.translation() = Eigen::Vector3d(3000, 3000, 0);
  far.add_scan(context(), cloud.view(), away);
  const PreparedMap wide = far.build();  // nearly all of a plan would be empty
  EXPECT_EQ(MapState::of(wide).plan(2).width, 0);
  const Query query(1, 0, 2);
  EXPECT_TRUE(places_of(scan_of(query.scan, MapState::of(wide)), wide).empty());

  const PreparedMap map = building({1, 2}, map_options());
  PointCloud few;
  few.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_TRUE(places_of(scan_of(few, MapState::of(map)), map).empty());
}

}  // namespace
}  // namespace gpureg::test
