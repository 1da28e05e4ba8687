// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstring>

#include "images.hpp"

namespace surfel::test {
namespace {

TEST(SurfelFusion, WallIsFlatAndFusedOnce) {
  Options options;
  options.stride = 2;
  const auto map = make_cpu_map(options, 2);
  for (int frame = 0; frame < 30; ++frame) {
    const Pose pose = shifted(0.002f * static_cast<float>(frame));
    fuse(*map, depth_of(wall(2), pose), pose, frame);
  }
  const Cloud surfels = map->download();
  // 156 x 116 cells have a normal; the camera moved by 5.8 cm, which is 3.8 cells of 1.5 cm; twice
  // as many surfels as cells would be two layers.
  EXPECT_GT(surfels.size(), 156u * 116u);
  EXPECT_LT(surfels.size(), 2u * 156u * 116u);
  double confidence = 0;
  for (const Surfel& s : surfels) {
    ASSERT_NEAR(s.position.z, 2, 1e-5) << "float's rounding";
    ASSERT_NEAR(s.normal.z, -1, 1e-5);
    ASSERT_LE(s.first, s.last);
    confidence = std::max(confidence, static_cast<double>(s.confidence));
    // Half the diagonal of a cell, 2 px at 2 m: 2 * 2 / (sqrt(2) * 262.5) = 1.08 cm, over the
    // cosine of the line of sight, at most 1 / .79 in the corners.
    ASSERT_GT(s.radius, 0.0107f);
    ASSERT_LT(s.radius, 0.0140f);
  }
  EXPECT_GT(confidence, 5) << "30 sightings at weights up to 1 / 4";
}

TEST(SurfelFusion, BallHasItsRadiusAndNormals) {
  const auto map = make_cpu_map({}, 1);
  const Shape shape = ball(0.1, 0, 2, 0.5);
  for (int frame = 0; frame < 20; ++frame) {
    const Pose pose =
        shifted(0.01f * static_cast<float>(frame), 0.005f * static_cast<float>(frame));
    fuse(*map, depth_of(shape, pose), pose, frame);
  }
  const Cloud surfels = map->download();
  ASSERT_GT(surfels.size(), 1000u);
  for (const Surfel& s : surfels) {
    const Vec from_centre = s.position - Vec{0.1f, 0, 2};
    const float distance = std::sqrt(dot(from_centre, from_centre));
    // A mean of points of a curved surface lies below it: 1 cm beside it by 0.1 mm, and the cells
    // of two views are at most 1.5 cm apart.
    ASSERT_NEAR(distance, 0.5, 0.002);
    // Central differences over 8 px, 6 cm, of a curved surface, near its rim.
    ASSERT_GT(dot(from_centre, s.normal) / distance, 0.95f);
  }
}

TEST(SurfelFusion, ThinningKeepsBothSidesAndTheMostConfident) {
  // A board of 1 x 1 m, seen from both sides, in two layers each: 1 mm apart, as two passages
  // leave them.
  Cloud surfels;
  for (const float side : {-1.0f, 1.0f}) {
    for (const float confidence : {1.0f, 2.0f}) {
      for (int k = 0; k < 10000; ++k) {
        const float x = 0.01f * static_cast<float>(k % 100),
                    y = 0.01f * static_cast<float>(k / 100);
        surfels.push_back({{x, y, 2 + 0.001f * confidence},
                           {0.1f, 0.1f, side},
                           0.005f,
                           confidence,
                           1,
                           2,
                           0x808080u});
      }
    }
  }
  const Cloud same = thinned(surfels, surfels.size());
  EXPECT_EQ(same.size(), surfels.size());
  const Cloud one = thinned(surfels, 20000);
  ASSERT_EQ(one.size(), 20000u) << "one layer for each side";
  for (const Surfel& s : one) ASSERT_EQ(s.confidence, 2);
  const Cloud few = thinned(surfels, 3000);
  EXPECT_LE(few.size(), 3000u);
  EXPECT_GT(few.size(), 1000u)
      << "cells grow by a factor of 1.6 in area, two layers may become one";
  for (const Surfel& s : few) EXPECT_GT(s.radius, 0.01f) << "no gaps between cells of 2 to 4 cm";
}

TEST(SurfelFusion, OldSurfelsTakeNoPartUntilTheyAreSeenAgain) {
  Options options;
  options.active_frames = 50;
  const auto map = make_cpu_map(options, 1);
  const std::vector<float> depth = depth_of(wall(2), Pose{});
  fuse(*map, depth, Pose{}, 0);
  const std::size_t once = map->size();
  fuse(*map, depth, Pose{}, 40);
  EXPECT_EQ(map->size(), once) << "still active: updated";
  fuse(*map, depth, Pose{}, 200);
  EXPECT_EQ(map->size(), 2 * once) << "out of the window: a second pass of its own";
  for (std::size_t k = 0; k < once; ++k) EXPECT_EQ(map->download()[k].last, 40);
  fuse(*map, depth, Pose{}, 210, /*since=*/205);
  EXPECT_EQ(map->size(), 3 * once) << "a new session does not touch the surfels of the last";
}

TEST(SurfelFusion, UnconfirmedSurfelsAreRemoved) {
  Options options;
  options.trial_frames = 30;
  const auto map = make_cpu_map(options, 1);
  // A speck that is there once, before a wall that stays. Alone it has weights below 1.
  fuse(*map, depth_of(ball(0, 0, 1.2, 0.2), Pose{}), Pose{}, 0);
  const std::size_t speck = map->size();
  ASSERT_GT(speck, 100u);
  const std::vector<float> depth = depth_of(wall(3), Pose{});
  for (int frame = 1; frame < 60; ++frame) fuse(*map, depth, Pose{}, frame);
  for (const Surfel& s : map->download()) ASSERT_NEAR(s.position.z, 3, 1e-4);
}

TEST(SurfelFusion, NothingFromEmptyImages) {
  const auto map = make_cpu_map({}, 1);
  fuse(*map, std::vector<float>(kWidth * kHeight, 0.0f), Pose{}, 0);
  EXPECT_EQ(map->size(), 0u);
}

TEST(SurfelFusion, SameBytesForAnyNumberOfThreads) {
  const auto one = make_cpu_map({}, 1), four = make_cpu_map({}, 4);
  for (int frame = 0; frame < 25; ++frame) {
    const Pose pose = shifted(0.01f * static_cast<float>(frame));
    const std::vector<float> depth = depth_of(ball(0.1, 0, 2, 0.7), pose);
    fuse(*one, depth, pose, frame);
    fuse(*four, depth, pose, frame);
  }
  const Cloud a = one->download(), b = four->download();
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(Surfel)), 0);
}

}  // namespace
}  // namespace surfel::test
