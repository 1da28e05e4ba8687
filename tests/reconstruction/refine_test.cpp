// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "reconstruction/relative_variances.hpp"
#include "reconstruction/rooms.hpp"

namespace gpureg::test {
namespace {

using reconstruction::RefineOptions;
using reconstruction::Surface;

TEST(Refine, BringsAllScansTogether) {
  const Rooms rooms;
  auto map = rooms.data.map();
  ASSERT_EQ(map.placed(), 5u);
  const double before = largest_error(map, rooms.data.world_from_scan, 0);
  const auto report = reconstruction::refine(rooms.surfaces, map);
  EXPECT_GT(before, 0.03);
  // The noise is a millimetre per point, of which thousands take part.
  EXPECT_LT(largest_error(map, rooms.data.world_from_scan, 0), 0.002);
  EXPECT_EQ(report.pairs, 10u);
  EXPECT_TRUE(report.solved);
  EXPECT_LT(report.final_rmse, report.initial_rmse);
  EXPECT_EQ(map.scans[0].island_from_scan.matrix(), Eigen::Matrix4d::Identity());
}

TEST(Refine, WithoutPointsTheEdgesHold) {
  const Rooms rooms;
  auto map = rooms.data.map();
  const double before = largest_error(map, rooms.data.world_from_scan, 0);
  const auto report = reconstruction::refine(std::vector<Surface>(5), map);
  EXPECT_EQ(report.pairs, 0u);
  EXPECT_TRUE(report.solved);
  // A tree of edges is a minimum already.
  EXPECT_NEAR(largest_error(map, rooms.data.world_from_scan, 0), before, 1e-6);
}

TEST(Refine, RejectsEdgesThatSurfacesContradict) {
  Rooms rooms;
  UnalignedIsometry3d off = rooms.data.truth(4, 0);
  off.translation().x() += 0.1;
  rooms.data.add(4, 0, 0.95, off);
  auto map = rooms.data.map();
  RefineOptions options;
  options.max_edge_error = 1;  // voxel of 5 cm
  const auto report = reconstruction::refine(rooms.surfaces, map, options);
  EXPECT_EQ(report.rejected_edges, 1u);
  EXPECT_FALSE(map.edges.back().accepted);
  EXPECT_EQ(map.edges.back().reason, reconstruction::EdgeReason::inconsistent);
  for (const auto& scan : map.scans) EXPECT_GT(scan.confidence, 0.5);
}

TEST(Refine, FarPointsWeighLess) {
  Surface surface = room(1);
  surface.viewpoints = {{0, 0, 0}};
  const std::vector<float> variances = reconstruction::relative_variances(surface, 1.0);
  for (std::size_t k = 0; k < surface.points.size(); k += 50)
    // Rounding of float.
    EXPECT_NEAR(variances[k], std::max(1.0, std::pow(surface.points[k].norm(), 4)), 1e-3);
  surface.viewpoints.clear();
  EXPECT_EQ(reconstruction::relative_variances(surface, 1.0)[0], 1.0f);
}

/// The origin that prepare() takes for an unknown viewpoint says nothing about ranges.
TEST(Refine, SurfacesHaveTheGivenViewpointsAlone) {
  const Surface points = room(1);
  PointCloudView cloud(points.points);
  const RegistrationOptions options;
  const RegistrationOptions finer = reconstruction::surface_options(options);
  const float viewpoint[] = {1, 1, 1};
  for (const std::size_t count : {0, 1}) {
    cloud.viewpoints = count > 0 ? viewpoint : nullptr;
    cloud.viewpoint_count = count;
    const Context context = Context::cpu(1);
    const Surface alone = reconstruction::surface_of(context, cloud, options);
    const Surface prepared = reconstruction::surface_of(prepare(context, cloud, finer));
    EXPECT_EQ(alone.viewpoints.size(), count);
    EXPECT_EQ(prepared.viewpoints.size(), count);
    EXPECT_EQ(prepared.points, alone.points);
    EXPECT_EQ(prepared.normals, alone.normals);
  }
}

TEST(Refine, RefusesBadInput) {
  auto map = PairResults(2).map();
  EXPECT_THROW(reconstruction::refine({}, map), InvalidArgument);
  std::vector<Surface> surfaces(2);
  surfaces[1].points.resize(3);
  EXPECT_THROW(reconstruction::refine(surfaces, map), InvalidArgument);
  RefineOptions options;
  options.final_distance = 10;
  EXPECT_THROW(reconstruction::refine(std::vector<Surface>(2), map, options), InvalidArgument);
}

}  // namespace
}  // namespace gpureg::test
