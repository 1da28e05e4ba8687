// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "images.hpp"

namespace surfel::test {
namespace {

Surfel seen(int first, int last, Vec position = {0, 0, 2}) {
  return {position, {0, 0, -1}, 0.01f, 3, first, last, 0};
}

/// A quarter turn about z.
Pose quarter(float x) {
  Pose pose = shifted(x);
  const float turn[9] = {0, -1, 0, 1, 0, 0, 0, 0, 1};
  for (int k = 0; k < 9; ++k) pose.r[k] = turn[k];
  return pose;
}

Vec corrected(const Surfel& surfel, const std::vector<Correction>& corrections) {
  const auto map = make_cpu_map({}, 1);
  map->upload({surfel});
  map->correct(corrections);
  return map->download().front().position;
}

TEST(SurfelCorrection, MeanOfTheKeyframesInTheWindow) {
  const std::vector<Correction> moves = {
      {0, shifted(5)}, {10, shifted(1)}, {20, shifted(3)}, {30, shifted(7)}};
  EXPECT_FLOAT_EQ(corrected(seen(5, 25), moves).x, 2) << "keyframes 10 and 20";
  EXPECT_FLOAT_EQ(corrected(seen(10, 30), moves).x, 3) << "t0 < t < tu, without the ends";
  EXPECT_FLOAT_EQ(corrected(seen(-1, 31), moves).x, 4) << "all";
}

TEST(SurfelCorrection, WithoutAKeyframeInTheWindowTheNearestMovesIt) {
  const std::vector<Correction> moves = {{0, shifted(1)}, {20, shifted(2)}, {50, shifted(3)}};
  EXPECT_FLOAT_EQ(corrected(seen(22, 22), moves).x, 2) << "a fresh surfel";
  EXPECT_FLOAT_EQ(corrected(seen(45, 48), moves).x, 3);
  EXPECT_FLOAT_EQ(corrected(seen(90, 95), moves).x, 3) << "after the last keyframe";
  EXPECT_FLOAT_EQ(corrected(seen(20, 20), moves).x, 2) << "of a keyframe itself";
}

TEST(SurfelCorrection, NotByAnotherSession) {
  const std::vector<Correction> moves = {{0, shifted(1), 0}, {50, shifted(9), 1}};
  EXPECT_FLOAT_EQ(corrected(seen(45, 48), moves).x, 1) << "nearer in time, but of session 1";
}

TEST(SurfelCorrection, RigidMotionOfAWall) {
  const auto map = make_cpu_map({}, 2);
  const std::vector<float> depth = depth_of(wall(2), Pose{});
  for (int frame = 0; frame < 20; ++frame) fuse(*map, depth, Pose{}, frame);
  const Cloud before = map->download();
  std::vector<Correction> moves;
  for (int frame = 0; frame < 20; frame += 5) moves.push_back({frame, quarter(0.5f)});
  map->correct(moves);
  const Cloud after = map->download();
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t k = 0; k < after.size(); ++k) {
    const Vec expected = transform(quarter(0.5f), before[k].position);
    ASSERT_NEAR(after[k].position.x, expected.x, 1e-6);
    ASSERT_NEAR(after[k].position.y, expected.y, 1e-6);
    ASSERT_NEAR(after[k].position.z, expected.z, 1e-6);
    ASSERT_NEAR(after[k].normal.z, -1, 1e-6);
  }
}

// Two passes over one wall, the second displaced by drift: the correction of the second brings both
// layers together, and leaves the first where it is.
TEST(SurfelCorrection, DriftOfASecondPassIsTakenBack) {
  Options options;
  options.active_frames = 30;
  const auto map = make_cpu_map(options, 1);
  const std::vector<float> depth = depth_of(wall(2), Pose{});
  std::vector<Correction> moves;
  for (int frame = 0; frame < 20; ++frame) {
    fuse(*map, depth, Pose{}, frame);
    if (frame % 5 == 0) moves.push_back({frame, Pose{}});
  }
  for (int frame = 100; frame < 120; ++frame) {
    fuse(*map, depth, shifted(0, 0, 0.1f), frame);
    if (frame % 5 == 0) moves.push_back({frame, shifted(0, 0, -0.1f)});
  }
  std::size_t far = 0;
  for (const Surfel& s : map->download()) far += s.position.z > 2.05f;
  ASSERT_EQ(2 * far, map->size());
  map->correct(moves);
  for (const Surfel& s : map->download()) ASSERT_NEAR(s.position.z, 2, 1e-5);
}

TEST(SurfelCorrection, NothingToDo) {
  const auto map = make_cpu_map({}, 1);
  map->correct({{0, shifted(1)}});
  map->upload({seen(0, 5)});
  map->correct({});
  EXPECT_EQ(map->download().front().position.x, 0);
}

}  // namespace
}  // namespace surfel::test
