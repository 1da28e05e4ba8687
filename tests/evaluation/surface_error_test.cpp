// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/evaluation/surface_error.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "evaluation/nearest_point.hpp"
#include "gpureg/error.hpp"

namespace gpureg::evaluation {
namespace {

using Points = std::vector<Eigen::Vector3f>;

struct Surface {
  Points points, normals;
};

/// A wall z = 0 of 2 x 2 m with a point each centimetre.
Surface wall() {
  Surface surface;
  for (int y = -100; y <= 100; ++y) {
    for (int x = -100; x <= 100; ++x) {
      surface.points.emplace_back(0.01f * static_cast<float>(x), 0.01f * static_cast<float>(y), 0);
      surface.normals.emplace_back(0, 0, 1);
    }
  }
  return surface;
}

Points parallel_to_wall(float distance) {
  Points map;
  for (int k = 0; k < 1000; ++k)
    map.emplace_back(0.8f * std::sin(static_cast<float>(k)),
                     0.8f * std::cos(2.0f * static_cast<float>(k)), distance);
  return map;
}

/// Points of a ball around the origin, about 0.7 cm apart at 0.5 m (Fibonacci).
Surface ball(float radius) {
  Surface surface;
  for (int k = 0; k < 60000; ++k) {
    const double z = 1 - (2 * k + 1) / 60000.0, r = std::sqrt(1 - z * z), a = 2.39996323 * k;
    const Eigen::Vector3f n(static_cast<float>(r * std::cos(a)),
                            static_cast<float>(r * std::sin(a)), static_cast<float>(z));
    surface.points.push_back(radius * n);
    surface.normals.push_back(n);
  }
  return surface;
}

TEST(SurfaceError, ShiftedPlane) {
  const Surface truth = wall();
  const SurfaceEvaluation e =
      evaluate_surface(parallel_to_wall(0.012f), truth.points, truth.normals);
  // The coordinates are floats.
  EXPECT_NEAR(e.distance.mean, 0.012, 1e-8);
  EXPECT_NEAR(e.distance.median, 0.012, 1e-8);
  EXPECT_NEAR(e.distance.max, 0.012, 1e-8);
  EXPECT_EQ(e.distance.count, 1000u);
  EXPECT_EQ(e.beyond, 0u);
  EXPECT_EQ(evaluate_surface(parallel_to_wall(0), truth.points, truth.normals).distance.max, 0);
}

TEST(SurfaceError, WithoutNormalsDistancesAreThoseToPoints) {
  const Surface truth = wall();
  const SurfaceEvaluation e = evaluate_surface(parallel_to_wall(0.012f), truth.points);
  EXPECT_GT(e.distance.mean, 0.012);
  // Half the diagonal of the grid is 7.1 mm.
  EXPECT_LT(e.distance.max, std::hypot(0.012, 0.00708));
  SurfaceOptions points_only;
  points_only.plane_reach = 0;
  EXPECT_EQ(evaluate_surface(parallel_to_wall(0.012f), truth.points, truth.normals, points_only)
                .distance.mean,
            e.distance.mean);
}

TEST(SurfaceError, LargerBall) {
  const Surface truth = ball(0.5f);
  const SurfaceEvaluation e = evaluate_surface(ball(0.52f).points, truth.points, truth.normals);
  // A tangent plane leaves the ball by 0.05 mm within 0.7 cm.
  EXPECT_NEAR(e.distance.mean, 0.02, 1e-4);
  EXPECT_NEAR(e.distance.median, 0.02, 1e-4);
}

TEST(SurfaceError, ShiftedBall) {
  // A shift by d along x moves a point with normal n by d * n.x off the surface: the mean of |n.x|
  // over a sphere is 1/2, so is its median.
  const Surface truth = ball(0.5f);
  Points shifted = truth.points;
  for (Eigen::Vector3f& p : shifted) p.x() += 0.01f;
  const SurfaceEvaluation e = evaluate_surface(shifted, truth.points, truth.normals);
  // Second order: d * d / (2 * radius) = 0.1 mm.
  EXPECT_NEAR(e.distance.mean, 0.005, 1e-4);
  EXPECT_NEAR(e.distance.median, 0.005, 1e-4);
}

TEST(SurfaceError, FarPointsCountAsTheLargestDistance) {
  const Surface truth = wall();
  const Points map = {{0, 0, 0}, {0, 0, 5}, {0, 0, 7}};
  const SurfaceEvaluation e = evaluate_surface(map, truth.points, truth.normals);
  EXPECT_NEAR(e.distance.mean, 2 * 0.2 / 3, 1e-12);
  EXPECT_EQ(e.beyond, 2u);
}

TEST(SurfaceError, PointsThatAreNotFiniteDoNotCount) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Surface truth = wall();
  truth.points[7].x() = nan;
  Points map = parallel_to_wall(0.01f);
  map[3].z() = std::numeric_limits<float>::infinity();
  const SurfaceEvaluation e = evaluate_surface(map, truth.points, truth.normals);
  EXPECT_EQ(e.skipped, 1u);
  EXPECT_EQ(e.distance.count, 999u);
  EXPECT_NEAR(e.distance.max, 0.01, 1e-8);
}

TEST(SurfaceError, BadInputIsNamed) {
  const Surface truth = wall();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(evaluate_surface({}, truth.points), InvalidArgument);
  EXPECT_THROW(evaluate_surface({{nan, 0, 0}}, truth.points), InvalidArgument);
  EXPECT_THROW(evaluate_surface(truth.points, {}), InvalidArgument);
  EXPECT_THROW(evaluate_surface(truth.points, truth.points, {{0, 0, 1}}), InvalidArgument);
  SurfaceOptions options;
  options.max_distance = 0;
  EXPECT_THROW(evaluate_surface(truth.points, truth.points, {}, options), InvalidArgument);
  options = {};
  options.plane_reach = -1;
  EXPECT_THROW(evaluate_surface(truth.points, truth.points, {}, options), InvalidArgument);
}

TEST(NearestPoint, AsByComparingAll) {
  std::mt19937 random(3);
  const auto number = [&] { return static_cast<float>(random() % 1000) / 1000; };
  for (const std::size_t count : {1u, 2u, 3u, 100u, 777u}) {
    Points points;
    for (std::size_t k = 0; k < count; ++k) points.emplace_back(number(), number(), number() / 20);
    const NearestPoint nearest(points);
    for (int query = 0; query < 200; ++query) {
      const Eigen::Vector3f place(2 * number() - 0.5f, 2 * number() - 0.5f, number());
      float best = std::numeric_limits<float>::infinity();
      for (const Eigen::Vector3f& p : points) best = std::min(best, (p - place).squaredNorm());
      EXPECT_EQ((points[nearest(place)] - place).squaredNorm(), best);
    }
  }
}

}  // namespace
}  // namespace gpureg::evaluation
