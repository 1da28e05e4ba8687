// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "localization/building.hpp"
#include "support/expect_error.hpp"

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
  EXPECT_TRUE(locate(context, {}, map, LocateOptions::from_voxel_size(kVoxel)).empty());
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

// Other scans of the call keep their results.
TEST_F(WrongInput, ATooSmallScanIsNotFound) {
  PointCloud small = query.scan;
  small.points.clear();
  for (const Eigen::Vector3f& p : query.scan.points)
    if ((p - query.scan.points.front()).norm() < 3 * kVoxel) small.points.push_back(p);
  ASSERT_GT(small.points.size(), 20u);
  const auto results = locate(context, {small.view(), query.scan.view()}, map,
                              LocateOptions::from_voxel_size(kVoxel));
  EXPECT_EQ(results[0].status, LocateStatus::not_found);
  EXPECT_EQ(results[1].status, LocateStatus::found);
}

TEST_F(WrongInput, VoxelSizesThatDoNotFit) {
  expect_error<InvalidArgument>(
      [&] { locate(context, {query.scan.view()}, map, LocateOptions::from_voxel_size(0.05f)); },
      {"voxel_size", "0.05", "0.1"});
  MapOptions options = map_options();
  options.prepare.voxel_size = 0;
  expect_error<InvalidArgument>([&] { MapBuilder{options}; }, {"prepare.voxel_size"});
  for (const float voxel : {1e-3f, 2.0f}) {
    PointCloud cloud;
    cloud.points = furnished_room(1, 1);
    expect_error<InvalidArgument>(
        [&] { prepare_map(cloud.view(), MapOptions::from_voxel_size(voxel)); },
        {"voxel_size", "does not fit"});
  }
}

TEST_F(WrongInput, Arguments) {
  expect_error<InvalidArgument>([] { MapBuilder(map_options()).build(); }, {"no points"});
  expect_error<InvalidArgument>([] { PreparedMap().size(); }, {"empty handle"});
  UnalignedIsometry3d mirror = UnalignedIsometry3d::Identity();
  mirror.matrix()(0, 0) = -1;
  MapBuilder builder(map_options());
  expect_error<InvalidArgument>([&] { builder.add_scan(context, query.scan.view(), mirror); },
                                {"rigid motion"});
  LocateOptions options = LocateOptions::from_voxel_size(kVoxel);
  options.candidates = 0;
  expect_error<InvalidArgument>([&] { locate(context, {query.scan.view()}, map, options); },
                                {"candidates", "0"});
  options = LocateOptions::from_voxel_size(kVoxel);
  options.coarse_factor = 0.5;
  expect_error<InvalidArgument>([&] { locate(context, {query.scan.view()}, map, options); },
                                {"coarse_factor", "0.5"});
  options = LocateOptions::from_voxel_size(kVoxel);
  options.coarse_tiles = 0;
  expect_error<InvalidArgument>([&] { locate(context, {query.scan.view()}, map, options); },
                                {"coarse_tiles", "0"});
  options = LocateOptions::from_voxel_size(kVoxel);
  options.fine_tiles = 0;
  expect_error<InvalidArgument>([&] { locate(context, {query.scan.view()}, map, options); },
                                {"fine_tiles", "0"});
  LocatePrior prior;
  prior.position = localization::PositionPrior{{0, 0, 0}, -1};
  expect_error<InvalidArgument>([&] { locate(context, query.scan.view(), map, prior); },
                                {"priors[0]", "radius"});
  expect_error<InvalidArgument>(
      [&] {
        locate(context, {query.scan.view()}, map, LocateOptions::from_voxel_size(kVoxel), {},
               {"a", "b"});
      },
      {"names", "2"});
}

}  // namespace
}  // namespace gpureg::test
