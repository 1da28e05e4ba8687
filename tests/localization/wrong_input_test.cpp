// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "gpureg/change.hpp"
#include "localization/building.hpp"
#include "support/expect_error.hpp"
#include "support/floor_plan.hpp"

namespace gpureg::test {
namespace {

class WrongInput : public testing::Test {
 protected:
  WrongInput() : context(Context::cpu(2)), map(building({1}, map_options())), query(1, 0, 1) {}

  LocateResult locate_here() const { return locate(context, query.scan.view(), map); }
  void scale(float factor) {
    for (Eigen::Vector3f& p : query.scan.points) p *= factor;
    for (Eigen::Vector3f& p : query.scan.viewpoints) p *= factor;
  }

  Context context;
  PreparedMap map;
  Query query;
};

TEST_F(WrongInput, PointsThatAreNotFiniteAreDropped) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int k = 0; k < 100; ++k) query.scan.points.emplace_back(nan, 0.f, 1.f);
  EXPECT_EQ(locate_here().status, LocateStatus::found);
}

TEST_F(WrongInput, NothingIsNotFound) {
  query.scan.points.clear();
  const LocateResult result = locate_here();
  EXPECT_EQ(result.status, LocateStatus::not_found);
  EXPECT_TRUE(result.poses.empty());
  EXPECT_EQ(result.absent_probability, 1);
  EXPECT_TRUE(locate(context, {}, map, LocateOptions{RegistrationOptions{kVoxel}}).empty());
}

TEST_F(WrongInput, AnotherUnitIsRecognised) {
  scale(1000);
  expect_error<InvalidArgument>([&] { locate_here(); },
                                {"scans[0]", "millimetres", "multiply the scan by 0.001"});
  scale(0.1f);
  expect_error<InvalidArgument>([&] { locate_here(); }, {"centimetres", "0.01"});
  scale(1e-5f);
  expect_error<InvalidArgument>([&] { locate_here(); },
                                {"scans[0]", "metres", "millimetres", "1000"});
}

// The view from above knows floors and walls of 3-D scans alone.
TEST_F(WrongInput, AScanOfA2dScannerIsRefused) {
  query.scan.points = FloorPlan2d().scan(pose_in_plan(-1.2, 0.8, 0.2), 1);
  query.scan.normals.clear();
  expect_error<InvalidArgument>([&] { locate_here(); }, {"scans[0]", "2-D scanner"});
}

// Other scans of the call keep their results.
TEST_F(WrongInput, ATooSmallScanIsNotFound) {
  PointCloud small = query.scan;
  small.points.clear();
  for (const Eigen::Vector3f& p : query.scan.points)
    if ((p - query.scan.points.front()).norm() < 3 * kVoxel) small.points.push_back(p);
  ASSERT_GT(small.points.size(), 20u);
  const auto results = locate(context, {small.view(), query.scan.view()}, map,
                              LocateOptions{RegistrationOptions{kVoxel}});
  EXPECT_EQ(results[0].status, LocateStatus::not_found);
  EXPECT_EQ(results[1].status, LocateStatus::found);
}

TEST_F(WrongInput, VoxelSizesThatDoNotFit) {
  expect_error<InvalidArgument>(
      [&] { locate(context, {query.scan.view()}, map, LocateOptions{RegistrationOptions{0.05f}}); },
      {"voxel_size", "0.05", "0.1"});
  MapOptions options = map_options();
  options.voxel_size = 0;
  expect_error<InvalidArgument>([&] { MapBuilder{options}; }, {"voxel_size"});
  for (const float voxel : {1e-3f, 2.0f}) {
    PointCloud cloud;
    cloud.points = furnished_room(1, 1);
    expect_error<InvalidArgument>([&] { prepare_map(cloud.view(), MapOptions{voxel}); },
                                  {"voxel_size", "does not fit"});
  }
}

// Numbers that float does not hold became cells of the plan, and their addresses.
TEST_F(WrongInput, PriorsOfNumbersThatAreNoPlaces) {
  for (const double far : {1e39, 1e30, -1e300, std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    LocatePrior prior;
    prior.position = localization::PositionPrior{{0, far, 0}, 2};
    expect_error<InvalidArgument>([&] { locate(context, query.scan.view(), map, prior); },
                                  {"priors[0].position.position is ", "1e12"});
  }
  LocatePrior prior;
  prior.position = localization::PositionPrior{{1e12, -1e12, 1e12}, 2};
  EXPECT_EQ(locate(context, query.scan.view(), map, prior).status, LocateStatus::not_found);
  prior.position = localization::PositionPrior{query.map_from_scan.translation(), 1e300};
  EXPECT_EQ(locate(context, query.scan.view(), map, prior).status, LocateStatus::found);
  prior = {};
  prior.gravity = GravityPrior{{0, 0, 1e200}, {0, 0, 1}, 10};
  expect_error<InvalidArgument>([&] { locate(context, query.scan.view(), map, prior); },
                                {"priors[0].gravity.source_up.norm is inf"});
}

TEST_F(WrongInput, PosesThatAreNoPlaces) {
  UnalignedIsometry3d pose(query.map_from_scan);
  for (const double far : {1e39, -1e300, std::numeric_limits<double>::infinity()}) {
    pose.translation().y() = far;
    MapBuilder builder(map_options());
    expect_error<InvalidArgument>([&] { builder.add_scan(context, query.scan.view(), pose); },
                                  {"map_from_scan"});
    expect_error<InvalidArgument>(
        [&] { localization::find_changes(context, query.scan.view(), map, pose); },
        {"map_from_scan"});
  }
}

TEST_F(WrongInput, CoordinatesAtTheEndOfFloat) {
  PointCloud surfaces;  // without sides: its normals are estimated
  surfaces.points = furnished_room(1, 1);
  const PreparedMap bare = prepare_map(surfaces.view(), map_options());
  PointCloud far = query.scan;
  far.viewpoints.clear();
  far.points.assign(5000, Eigen::Vector3f::Constant(3e38f));
  for (const PreparedMap& any : {map, bare}) {
    expect_error<InvalidArgument>([&] { locate(context, far.view(), any); },
                                  {"scans[0]", "3.0", "e+38", "at most 1e12"});
    expect_error<InvalidArgument>(
        [&] {
          localization::find_changes(context, far.view(), any, UnalignedIsometry3d::Identity());
        },
        {"scan: its points lie 3", "e+38", "at most 1e12"});
  }
  far.points = query.scan.points;
  far.origin = Eigen::Vector3d::Constant(1e300);
  expect_error<InvalidArgument>([&] { locate(context, far.view(), map); },
                                {"cloud.origin is 1e+300", "1e12"});
}

// Heights are counted from the lowest to the highest: a bird high above the scan is no reason for
// gigabytes.
TEST_F(WrongInput, AStrayPointFarAboveTheScan) {
  PointCloud above = query.scan;
  const Eigen::Vector3f up =
      query.map_from_scan.inverse().linear().cast<float>() * Eigen::Vector3f::UnitZ();
  for (int k = 0; k < 40; ++k)
    above.points.push_back(4e4f * up + Eigen::Vector3f(0.05f * static_cast<float>(k % 7),
                                                       0.05f * static_cast<float>(k / 7), 0));
  EXPECT_EQ(locate(context, above.view(), map).status, LocateStatus::found);
}

TEST_F(WrongInput, Arguments) {
  expect_error<InvalidArgument>([] { MapBuilder(map_options()).build(); }, {"no points"});
  expect_error<InvalidArgument>([] { PreparedMap().size(); }, {"empty handle"});
  UnalignedIsometry3d mirror = UnalignedIsometry3d::Identity();
  mirror.matrix()(0, 0) = -1;
  MapBuilder builder(map_options());
  expect_error<InvalidArgument>([&] { builder.add_scan(context, query.scan.view(), mirror); },
                                {"rigid motion"});
  UnalignedIsometry3d transposed = UnalignedIsometry3d::Identity();
  transposed.matrix()(3, 0) = 2;
  expect_error<InvalidArgument>([&] { builder.add_scan(context, query.scan.view(), transposed); },
                                {"looks transposed"});
  expect_error<InvalidArgument>(
      [&] {
        localization::find_changes(context, query.scan.view(), map, transposed,
                                   localization::ChangeOptions{});
      },
      {"looks transposed"});
  LocateOptions options = LocateOptions{RegistrationOptions{kVoxel}};
  options.candidates = 0;
  expect_error<InvalidArgument>([&] { locate(context, {query.scan.view()}, map, options); },
                                {"candidates", "0"});
  options = LocateOptions{RegistrationOptions{kVoxel}};
  options.coarse_factor = 0.5;
  expect_error<InvalidArgument>([&] { locate(context, {query.scan.view()}, map, options); },
                                {"coarse_factor", "0.5"});
  options = LocateOptions{RegistrationOptions{kVoxel}};
  options.coarse_tiles = 0;
  expect_error<InvalidArgument>([&] { locate(context, {query.scan.view()}, map, options); },
                                {"coarse_tiles", "0"});
  options = LocateOptions{RegistrationOptions{kVoxel}};
  options.fine_tiles = 0;
  expect_error<InvalidArgument>([&] { locate(context, {query.scan.view()}, map, options); },
                                {"fine_tiles", "0"});
  localization::ChangeOptions changes;
  changes.tolerance = 1e300;
  expect_error<InvalidArgument>(
      [&] {
        localization::find_changes(context, query.scan.view(), map, UnalignedIsometry3d::Identity(),
                                   changes);
      },
      {"tolerance is 1e+300"});
  options = LocateOptions{RegistrationOptions{kVoxel}};
  options.registration.calibration.offset = 1;  // of pairs: places have a fit of their own
  expect_error<InvalidArgument>([&] { locate(context, {query.scan.view()}, map, options); },
                                {"registration.calibration", "of pairs"});
  LocatePrior prior;
  prior.position = localization::PositionPrior{{0, 0, 0}, -1};
  expect_error<InvalidArgument>([&] { locate(context, query.scan.view(), map, prior); },
                                {"priors[0]", "radius"});
  expect_error<InvalidArgument>(
      [&] {
        locate(context, {query.scan.view()}, map, LocateOptions{RegistrationOptions{kVoxel}}, {},
               {"a", "b"});
      },
      {"names", "2"});
}

}  // namespace
}  // namespace gpureg::test
