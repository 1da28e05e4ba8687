// SPDX-License-Identifier: BSD-3-Clause
#include "loops/image_loop.hpp"

#include <gtest/gtest.h>

#include <random>

#include "slam_demo/pose_at.hpp"

namespace slam_demo {
namespace {

/// 60 points on a curved wall, and keyframes that see all of them.
struct Wall {
  Map map;
  Pinhole camera;
  std::vector<Eigen::Vector3d> points;
  std::vector<Descriptor> descriptors;
  Wall() {
    std::mt19937_64 random(1);
    for (int k = 0; k < 60; ++k) {
      const double x = -1 + 0.2 * (k % 10), y = -0.6 + 0.2 * (k / 10);
      points.emplace_back(x, y, 2.5 + 0.3 * x * x - 0.2 * x * y);
      descriptors.push_back({random(), random(), random(), random()});
    }
  }
  /// A keyframe that sees the points from truth, and that the map has at another pose.
  int add(const Eigen::Isometry3d& truth, const Eigen::Isometry3d& in_map) {
    auto seen = std::make_shared<Features>();
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Eigen::Vector3d p = truth.inverse() * points[k];
      const Eigen::Vector2d pixel = camera.project(p);
      seen->keys.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()), 31.0f);
      seen->keys.back().octave = 0;
      seen->descriptors.push_back(descriptors[k]);
      seen->depth.push_back(static_cast<float>(p.z()));
    }
    seen->index();
    Keyframe keyframe;
    keyframe.frame = static_cast<int>(map.keyframes.size()) * 100;
    keyframe.world_from_camera = in_map;
    keyframe.features = seen;
    return map.add_keyframe(keyframe);
  }
};

// The map has the pose of a keyframe that a false loop moved, or that no optimisation has moved
// yet: what the loop made it observe says nothing about where it is.
TEST(ImageLoop, ItsEdgeStartsAtAKeyframeThatTrackingSawThePointsFrom) {
  Wall wall;
  const int moved = wall.add(at(0.1, 0, 0), at(3, 0, 0)),
            still = wall.add(at(0, 0, 0), at(0, 0, 0)),
            new_one = wall.add(at(-0.1, 0, 0, 0.05), at(2, 0, 0));
  for (int k = 0; k < 60; ++k) {
    wall.map.add_point(still, k, wall.points[static_cast<std::size_t>(k)]);
    wall.map.add_observation(k, {moved, k, /*loop=*/7});
  }
  const auto check = [&](const std::optional<ImageLoop>& loop) {
    ASSERT_TRUE(loop);
    EXPECT_EQ(loop->edge.a, still);
    EXPECT_EQ(loop->edge.b, new_one);
    EXPECT_TRUE(loop->edge.a_from_b.isApprox(at(-0.1, 0, 0, 0.05), 1e-3));
    EXPECT_EQ(loop->inliers, 60);
  };
  check(image_loop_near(wall.map, wall.camera, new_one, at(-0.05, 0.02, 0, 0.03), {still}));
  check(image_loop_anywhere(wall.map, wall.camera, new_one, {still}, 50));
}

TEST(ImageLoop, APoseFarFromThePredictionIsNone) {
  Wall wall;
  const int still = wall.add(at(0, 0, 0), at(0, 0, 0)),
            new_one = wall.add(at(-0.1, 0, 0), at(2, 0, 0));
  for (int k = 0; k < 60; ++k)
    wall.map.add_point(still, k, wall.points[static_cast<std::size_t>(k)]);
  const auto from = [&](double x) {
    return image_loop_near(wall.map, wall.camera, new_one, at(x, 0, 0), {still}).has_value();
  };
  EXPECT_TRUE(from(-0.2));
  EXPECT_FALSE(from(-0.36)) << "0.26 m";
}

}  // namespace
}  // namespace slam_demo
