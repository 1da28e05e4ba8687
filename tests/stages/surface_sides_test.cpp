// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <map>
#include <tuple>

#include "algorithm/evidence.hpp"
#include "api/with_settings.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg::cpu {
namespace {

using test::seen_from;

/// A square metre of floor, seen from above, a grid of points at a height.
std::vector<Vec3> floor_at(float height) {
  std::vector<Vec3> points;
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 60; ++x)
      points.push_back(
          {0.02f * static_cast<float>(x) - 0.6f, 0.02f * static_cast<float>(y) - 0.6f, height});
  return points;
}

/// Of a place in the cloud's own frame.
std::uint32_t place(const CpuCloud& cloud, Vec3 p) {
  return surface_side_at(cloud.surface_sides.view(),
                         p - Vec3{cloud.origin[0], cloud.origin[1], cloud.origin[2]});
}

TEST(SurfaceSides, AFloorHasAFrontAndABack) {
  Exec exec(1);
  const auto cloud = seen_from(exec, floor_at(0.02f), {0, 0, 2});
  EXPECT_EQ(place(*cloud, {0, 0, 0.02f}) & kOnSurface, kOnSurface);
  for (const float h : {0.17f, 0.22f})
    EXPECT_EQ(place(*cloud, {0.1f, 0.2f, 0.02f + h}), kFrontNear) << h;
  for (const float h : {0.32f, 0.47f})
    EXPECT_EQ(place(*cloud, {0.1f, 0.2f, 0.02f + h}), kFrontFar) << h;
  for (const float h : {0.17f, 0.32f, 0.47f})
    EXPECT_EQ(place(*cloud, {0.1f, 0.2f, 0.02f - h}), kBehind) << h;
  for (const float h : {0.67f, -0.67f, 50.0f, -1e20f, 1e30f})
    EXPECT_EQ(place(*cloud, {0.1f, 0.2f, h}), 0u) << h;
  EXPECT_EQ(place(*cloud, {1.5f, 0, 0.2f}), 0u);
}

TEST(SurfaceSides, FollowTheOrientationOfNormals) {
  Exec exec(1);
  const std::vector<Vec3> points = floor_at(0.02f), down(points.size(), Vec3{0.3f, 0, -2});
  RawCloud raw = test::raw_cloud(points);
  raw.normals = &down[0].x;
  const auto cloud = test::prepare_one(exec, raw, {});
  EXPECT_EQ(place(*cloud, {0.1f, 0.2f, 0.22f}), kBehind);
  EXPECT_EQ(place(*cloud, {0.1f, 0.2f, -0.18f}), kFrontNear);
}

TEST(SurfaceSides, EndAtTheNextSurface) {
  Exec exec(1);
  std::vector<Vec3> points = floor_at(0.02f);
  const std::vector<Vec3> ceiling = floor_at(0.32f);
  points.insert(points.end(), ceiling.begin(), ceiling.end());
  std::vector<Vec3> up(points.size(), Vec3{0, 0, 1});
  RawCloud raw = test::raw_cloud(points);
  raw.normals = &up[0].x;
  const auto cloud = test::prepare_one(exec, raw, {});
  // Cells above the upper surface are in front of it alone: the front of the lower one ends there.
  EXPECT_EQ(place(*cloud, {0, 0, 0.47f}), kFrontNear);
  EXPECT_EQ(place(*cloud, {0, 0, 0.17f}), kFrontNear | kBehind);
}

TEST(SurfaceSides, EqualAMarchOverAMapOfCells) {
  std::mt19937 random(3);
  Exec exec(2);
  PrepareSettings options;
  using Key = std::tuple<int, int, int>;
  for (int trial = 0; trial < 4; ++trial) {
    options.surface_side_distance = trial < 2 ? 0.5f : 0.37f;
    options.voxel_size = trial % 2 == 0 ? 0.05f : 0.0f;
    const auto points =
        trial == 3 ? test::cube(random, 3000, 1.0f) : test::bumpy_sheet(random, 4000, 1.7f);
    const auto cloud = test::prepare_one(exec, test::raw_cloud(points), options);
    const float inverse = cloud->surface_sides.box.inverse_cell_size,
                size = cloud->surface_sides.box.cell_size;
    const auto key = [&](Vec3 p) {
      const Cell c = cell_of(p, inverse);
      return Key{c.x, c.y, c.z};
    };
    std::map<Key, std::uint32_t> surface, expected;
    for (const Vec3& p : cloud->points) surface[key(p)] = kOnSurface;
    expected = surface;
    for (std::size_t i = 0; i < cloud->points.size(); ++i)
      for (const float side : {1.0f, -1.0f})
        for (int step = 2; step <= 10 && !is_zero(cloud->normals[i]); ++step) {
          const float h = side * size * static_cast<float>(step);
          const Vec3 p = cloud->points[i], n = cloud->normals[i];
          const Key k = key({fmaf(n.x, h, p.x), fmaf(n.y, h, p.y), fmaf(n.z, h, p.z)});
          if (surface.count(k)) break;
          expected[k] |= side < 0 ? kBehind : step <= 5 ? kFrontNear : kFrontFar;
        }
    std::size_t marked = 0;
    for (const std::uint32_t word : cloud->surface_sides.words)
      for (std::uint32_t shift = 0; shift < 32; shift += 4) marked += (word >> shift & 15) != 0;
    EXPECT_EQ(marked, expected.size());
    for (const auto& [k, bits] : expected) {
      const auto [x, y, z] = k;
      const Vec3 middle{(static_cast<float>(x) + 0.5f) * size,
                        (static_cast<float>(y) + 0.5f) * size,
                        (static_cast<float>(z) + 0.5f) * size};
      ASSERT_EQ(surface_side_at(cloud->surface_sides.view(), middle), bits)
          << x << " " << y << " " << z;
    }
  }
}

TEST(SurfaceSides, NoneWhereSwitchedOffOrTooWide) {
  Exec exec(1);
  PrepareSettings options;
  options.surface_side_distance = 0;
  EXPECT_EQ(seen_from(exec, floor_at(0), {0, 0, 2}, options)->surface_sides.view().words, nullptr);
  EXPECT_EQ(seen_from(exec, {}, {0, 0, 2})->surface_sides.view().words, nullptr);
  std::vector<Vec3> wide = floor_at(0);
  wide.push_back({3e3f, 2e3f, 1e3f});
  EXPECT_EQ(seen_from(exec, wide, {0, 0, 2})->surface_sides.view().words, nullptr);
  wide.back() = {60, 0, 0};
  EXPECT_NE(seen_from(exec, wide, {0, 0, 2})->surface_sides.view().words, nullptr);
  // Corners whose cells no integer counts.
  for (const float far : {1e9f, 3e18f, 3e38f})
    EXPECT_EQ(surface_side_grid({-far, -far, -far}, {far, far, far}, 1e-6f, true).words(), 0u);
  EXPECT_GT(surface_side_grid({3e7f, 0, 0}, {3e7f, 1, 1}, 0.5f, true).words(), 0u);
  EXPECT_EQ(surface_side_grid({9e8f, 0, 0}, {9e8f, 1, 1}, 0.5f, true).words(), 0u);
}

TEST(SurfaceSides, ClassifyPointsByTheirSide) {
  Exec exec(1);
  const auto target = seen_from(exec, floor_at(0.02f), {0, 0, 2});
  const auto of = [&](float height) {
    return test::verified_in_place(exec, *seen_from(exec, floor_at(0.02f + height), {0, 0, 2}),
                                   *target)
        .modes[0]
        .source;
  };
  const SideEvidence on = of(0), near = of(0.2f), far = of(0.4f), back = of(-0.3f), away = of(1.0f);
  EXPECT_EQ(on[Term::hits], on[Term::tested]);
  EXPECT_EQ(on[Term::near_surface], on[Term::tested]);
  EXPECT_EQ(
      on[Term::front_violation_near] + on[Term::front_violation_far] + on[Term::behind_surface], 0);
  EXPECT_GT(near[Term::front_violation_near], near[Term::tested] * 9 / 10);
  EXPECT_GT(far[Term::front_violation_far], far[Term::tested] * 9 / 10);
  EXPECT_GT(back[Term::behind_surface], back[Term::tested] * 9 / 10);
  EXPECT_EQ(near[Term::front_violation_far] + near[Term::behind_surface] +
                far[Term::front_violation_near] + far[Term::behind_surface] +
                back[Term::front_violation_near] + back[Term::front_violation_far],
            0);
  EXPECT_EQ(away[Term::near_surface], 0);
}

}  // namespace
}  // namespace gpureg::cpu
