// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "reconstruction/pair_results.hpp"
#include "reconstruction/surface_grid.hpp"
#include "reconstruction/surface_pairs.hpp"

namespace gpureg::test {
namespace {

using reconstruction::RefineOptions;
using reconstruction::Surface;

/// Points on three walls of a room and on a box, 5 cm apart, with a millimetre of noise; each
/// number is another sample.
Surface room(int number) {
  std::mt19937 random(static_cast<unsigned>(number));
  std::uniform_real_distribution<float> unit;
  std::normal_distribution<float> noise(0, 0.001f);
  Surface out;
  const auto plane = [&](const Eigen::Vector3f& corner, const Eigen::Vector3f& a,
                         const Eigen::Vector3f& b) {
    const Eigen::Vector3f n = a.cross(b).normalized();
    const int count = static_cast<int>(400 * a.cross(b).norm());
    for (int k = 0; k < count; ++k) {
      out.points.push_back(corner + unit(random) * a + unit(random) * b + noise(random) * n);
      out.normals.push_back(n);
    }
  };
  plane({0, 0, 0}, {3, 0, 0}, {0, 2, 0});
  plane({0, 0, 0}, {0, 2, 0}, {0, 0, 2});
  plane({0, 0, 0}, {0, 0, 2}, {3, 0, 0});
  plane({1, 1, 0.5f}, {0.7f, 0, 0}, {0, 0.5f, 0});
  return out;
}

Surface moved(const UnalignedIsometry3d& pose, const Surface& surface) {
  Surface out;
  for (std::size_t k = 0; k < surface.points.size(); ++k) {
    out.points.push_back((pose * surface.points[k].cast<double>()).cast<float>());
    out.normals.push_back((pose.linear() * surface.normals[k].cast<double>()).cast<float>());
  }
  return out;
}

/// Five scans of the room with pairs that are 2 to 4 cm off.
struct Rooms {
  PairResults data{5};
  std::vector<Surface> surfaces;
  Rooms() {
    for (std::uint32_t k = 0; k < 5; ++k)
      surfaces.push_back(moved(data.world_from_scan[k].inverse(), room(static_cast<int>(k))));
    for (std::uint32_t k = 1; k < 5; ++k) {
      UnalignedIsometry3d off = data.truth(k, k - 1);
      off.translation() += Eigen::Vector3d(0.02, -0.02, 0.01 * k);
      data.add(k, k - 1, 0.95, off);
    }
  }
};

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

TEST(Refine, SameBytesOnAnyNumberOfThreads) {
  const Rooms rooms;
  auto one = rooms.data.map(), four = one;
  RefineOptions options;
  options.threads = 1;
  reconstruction::refine(rooms.surfaces, one, options);
  options.threads = 4;
  reconstruction::refine(rooms.surfaces, four, options);
  EXPECT_EQ(bytes_of(one), bytes_of(four));
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
  options.max_edge_error = 0.05;
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

TEST(Refine, RefusesBadInput) {
  auto map = PairResults(2).map();
  EXPECT_THROW(reconstruction::refine({}, map), InvalidArgument);
  std::vector<Surface> surfaces(2);
  surfaces[1].points.resize(3);
  EXPECT_THROW(reconstruction::refine(surfaces, map), InvalidArgument);
  RefineOptions options;
  options.final_distance = 1;
  EXPECT_THROW(reconstruction::refine(std::vector<Surface>(2), map, options), InvalidArgument);
}

TEST(SurfaceGrid, FindsWhatAFullSearchFinds) {
  const Surface surface = room(1), queries = room(2);
  const float distance = 0.05f;
  const reconstruction::SurfaceGrid grid(surface, distance);
  for (std::size_t q = 0; q < queries.points.size(); q += 7) {
    std::uint32_t best = reconstruction::SurfaceGrid::kNone;
    float least = distance * distance;
    for (std::uint32_t k = 0; k < surface.points.size(); ++k) {
      const float squared = (surface.points[k] - queries.points[q]).squaredNorm();
      if (surface.normals[k].dot(queries.normals[q]) < 0.7f || squared > least) continue;
      if (squared == least && best != reconstruction::SurfaceGrid::kNone) continue;
      least = squared;
      best = k;
    }
    EXPECT_EQ(grid.closest(queries.points[q], queries.normals[q], 0.7f), best);
  }
}

}  // namespace
}  // namespace gpureg::test
