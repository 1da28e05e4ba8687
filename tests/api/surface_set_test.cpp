// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/surface_set.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "gpureg/error.hpp"
#include "support/expect_error.hpp"
#include "support/surfaces.hpp"

namespace gpureg::test {
namespace {

/// The same sums by comparing all points with all points, in double precision.
PointToPlaneSums exhaustive(const TestSurface& source, const TestSurface& target,
                            const UnalignedIsometry3d& pose, const PointToPlaneOptions& options) {
  PointToPlaneSums out;
  const double min_cosine = std::cos(options.max_normal_angle * M_PI / 180);
  for (std::size_t i = 0; i < source.points.size(); ++i) {
    const Eigen::Vector3d p = pose * source.points[i].cast<double>(),
                          m = pose.linear() * source.normals[i].cast<double>();
    double least = options.max_distance * options.max_distance;
    std::size_t best = target.points.size();
    for (std::size_t k = 0; k < target.points.size(); ++k) {
      const double squared = (target.points[k].cast<double>() - p).squaredNorm();
      if (squared > least || target.normals[k].cast<double>().dot(m) < min_cosine) continue;
      least = squared;
      best = k;
    }
    if (best == target.points.size()) continue;
    const Eigen::Vector3d n = target.normals[best].cast<double>();
    const double residual = n.dot(p - target.points[best].cast<double>());
    const double kernel = options.kernel_width * options.kernel_width,
                 ratio = kernel / (kernel + residual * residual),
                 variance = 0.5 * (static_cast<double>(source.variances[i]) +
                                   static_cast<double>(target.variances[best]));
    Eigen::Matrix<double, 6, 1> j;
    j << p.cross(n), n;
    const double weight = ratio * ratio / variance;
    out.information += weight * j * j.transpose();
    out.gradient += weight * residual * j;
    ++out.count;
    out.squared_distance += residual * residual;
  }
  return out;
}

TEST(SurfaceSet, AddsUpWhatAFullSearchFinds) {
  const SurfaceScene scene(3, 900);
  PointToPlaneOptions options;
  options.max_points = 1000;
  const SurfaceSet set(Context::cpu(2), scene.views());
  const auto sums = set.linearise(scene.pairs, options);
  std::size_t most = 0;
  for (std::size_t p = 0; p < scene.pairs.size(); ++p) {
    const SurfacePair& pair = scene.pairs[p];
    const auto expected = exhaustive(scene.surfaces[pair.source], scene.surfaces[pair.target],
                                     pair.target_from_source, options);
    most = std::max(most, expected.count);
    EXPECT_EQ(sums[p].count, expected.count);
    EXPECT_NEAR(sums[p].squared_distance, expected.squared_distance,
                1e-4 * expected.squared_distance);
    // The sums are of float terms.
    EXPECT_LT((sums[p].information - expected.information).norm(),
              1e-5 * expected.information.norm());
    EXPECT_LT((sums[p].gradient - expected.gradient).norm(),
              1e-4 * std::sqrt(expected.information.norm() * expected.squared_distance));
  }
  EXPECT_GT(most, 200u);
}

TEST(SurfaceSet, ChosenPointsStandForAll) {
  const SurfaceScene scene(2, 8000);
  PointToPlaneOptions all, some;
  all.max_points = 8000;
  some.max_points = 2000;
  const SurfaceSet set(Context::cpu(2), scene.views());
  const auto a = set.linearise(scene.pairs, all), b = set.linearise(scene.pairs, some);
  for (std::size_t p = 0; p < scene.pairs.size(); ++p) {
    EXPECT_NEAR(static_cast<double>(b[p].count), static_cast<double>(a[p].count) / 4,
                0.2 * static_cast<double>(b[p].count));
    EXPECT_LT((a[p].information - b[p].information).norm(), 0.2 * a[p].information.norm());
  }
}

TEST(SurfaceSet, TheBitsDoNotDependOnThreadsOrOnOtherPairs) {
  const SurfaceScene scene(4, 3000);
  const SurfaceSet one(Context::cpu(1), scene.views()), four(Context::cpu(4), scene.views());
  const auto expected = one.linearise(scene.pairs);
  const auto sums = four.linearise(scene.pairs);
  for (std::size_t p = 0; p < scene.pairs.size(); ++p) {
    EXPECT_TRUE(same_bits(expected[p], sums[p]));
    EXPECT_TRUE(same_bits(expected[p], four.linearise({scene.pairs[p]})[0]));
  }
  // Tables of another distance come and go.
  PointToPlaneOptions narrow;
  narrow.max_distance = 0.02;
  EXPECT_LT(four.linearise(scene.pairs, narrow)[0].count, expected[0].count);
  EXPECT_TRUE(same_bits(expected[0], four.linearise(scene.pairs)[0]));
}

TEST(SurfaceSet, OddPointsTakeNoPart) {
  SurfaceScene scene(2, 2000);
  const auto expected = SurfaceSet(Context::cpu(1), scene.views()).linearise(scene.pairs);
  for (TestSurface& surface : scene.surfaces) {
    surface.add({std::numeric_limits<float>::quiet_NaN(), 0, 0}, {0, 0, 1});
    surface.add({0, std::numeric_limits<float>::infinity(), 0}, {0, 0, 1});
    surface.add(surface.points[0], {0, 0, 0});
    surface.add(surface.points[0], {0, 0, 7});
  }
  const auto sums = SurfaceSet(Context::cpu(1), scene.views()).linearise(scene.pairs);
  for (std::size_t p = 0; p < scene.pairs.size(); ++p) {
    EXPECT_EQ(sums[p].count, expected[p].count);
    EXPECT_EQ(sums[p].information, expected[p].information);
  }
  // A stray point far away widens the box beyond the range of cells.
  for (TestSurface& surface : scene.surfaces) surface.add({3e8f, -3e8f, 3e8f}, {0, 0, 1});
  const auto far = SurfaceSet(Context::cpu(1), scene.views()).linearise(scene.pairs);
  for (std::size_t p = 0; p < scene.pairs.size(); ++p) EXPECT_EQ(far[p].count, expected[p].count);
}

TEST(SurfaceSet, EmptyAndCoincidentSurfaces) {
  TestSurface empty, same;
  for (int k = 0; k < 500; ++k) same.add({1, 2, 3}, {0, 0, 1});
  const std::vector<SurfaceView> views{empty.view(), same.view(), same.view()};
  const SurfaceSet set(Context::cpu(2), views);
  EXPECT_EQ(set.size(), 3u);
  const auto sums = set.linearise({{0, 1}, {1, 0}, {0, 0}, {1, 2}});
  for (int k = 0; k < 3; ++k) EXPECT_EQ(sums[static_cast<std::size_t>(k)].count, 0u);
  EXPECT_EQ(sums[3].count, 500u);
  EXPECT_EQ(sums[3].squared_distance, 0);
  EXPECT_TRUE(set.linearise({}).empty());
  EXPECT_EQ(SurfaceSet(Context::cpu(1), {}).size(), 0u);
}

TEST(SurfaceSet, RefusesBadInput) {
  TestSurface surface;
  surface.add({0, 0, 0}, {0, 0, 1});
  SurfaceView view = surface.view();
  const Context context = Context::cpu(1);
  const auto make = [&] { SurfaceSet(context, {surface.view(), view}); };
  view.points = nullptr;
  expect_error<InvalidArgument>([&] { make(); }, {"surfaces[1].points is null"});
  view = surface.view();
  view.normals = nullptr;
  expect_error<InvalidArgument>([&] { make(); }, {"surfaces[1].normals is null"});
  view = surface.view();
  view.size = std::size_t(1) << 31;
  expect_error<InvalidArgument>([&] { make(); }, {"surfaces[1].size is 2147483648"});
  view = surface.view();
  for (const float bad :
       {0.5f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    view.variances = &bad;
    expect_error<InvalidArgument>([&] { make(); }, {"surfaces[1].variances[0] is "});
  }
  const SurfaceSet set(context, {surface.view()});
  expect_error<InvalidArgument>([&] { set.linearise({{0, 0}, {0, 1}}); }, {"pairs[1].target is 1"});
  expect_error<InvalidArgument>([&] { set.linearise({{7, 0}}); }, {"pairs[0].source is 7"});
  SurfacePair pair;
  pair.target_from_source.translation().x() = std::nan("");
  expect_error<InvalidArgument>([&] { set.linearise({pair}); },
                                {"pairs[0].target_from_source is not finite"});
  PointToPlaneOptions options;
  options.max_distance = 0;
  expect_error<InvalidArgument>([&] { set.linearise({}, options); }, {"max_distance is 0"});
  options = {};
  options.max_points = 3;
  expect_error<InvalidArgument>([&] { set.linearise({}, options); }, {"max_points is 3"});
}

}  // namespace
}  // namespace gpureg::test
