// SPDX-License-Identifier: BSD-3-Clause
#include "mapping/map.hpp"

#include <gtest/gtest.h>

#include "mapping/bundle.hpp"
#include "mapping/keyframe_graph.hpp"
#include "slam_demo/pose_at.hpp"

namespace slam_demo {
namespace {

std::shared_ptr<Features> features(std::size_t count) {
  auto f = std::make_shared<Features>();
  f->keys.resize(count);
  f->descriptors.resize(count);
  f->depth.assign(count, 1.0f);
  f->index();
  return f;
}

int add(Map& map, const Eigen::Isometry3d& pose, int session = 0, std::size_t count = 10) {
  Keyframe keyframe;
  keyframe.frame = static_cast<int>(map.keyframes.size()) * 10;
  keyframe.session = session;
  keyframe.world_from_camera = pose;
  keyframe.features = features(count);
  return map.add_keyframe(keyframe);
}

TEST(Map, SharedPointsAreCounted) {
  Map map;
  const int a = add(map, at(0, 0, 0)), b = add(map, at(1, 0, 0)), c = add(map, at(2, 0, 0));
  const int p = map.add_point(a, 0, {0, 0, 2}), q = map.add_point(a, 1, {1, 0, 2});
  map.add_observation(p, {b, 4});
  map.add_observation(q, {b, 5});
  map.add_observation(q, {c, 5});
  EXPECT_EQ(map.keyframes[0].covisible, (std::map<int, int>{{b, 2}, {c, 1}}));
  EXPECT_EQ(map.covisible(a, 5), (std::vector<int>{b, c}));
  EXPECT_EQ(map.covisible(a, 5, 2), (std::vector<int>{b}));
  map.add_observation(q, {c, 6});
  EXPECT_EQ(map.points[1].observations.size(), 3u) << "a keyframe sees a point once";
  map.remove_observation(q, b, 5);
  EXPECT_EQ(map.keyframes[0].covisible, (std::map<int, int>{{b, 1}, {c, 1}}));
  EXPECT_EQ(map.keyframes[1].points[5], kNone);
  map.remove_point(p);
  EXPECT_TRUE(map.points[0].bad);
  EXPECT_EQ(map.keyframes[0].covisible, (std::map<int, int>{{c, 1}}));
}

TEST(Map, ARetractionTakesTheObservationsBack) {
  Map map;
  const int a = add(map, at(0, 0, 0)), b = add(map, at(1, 0, 0));
  const int p = map.add_point(a, 0, {0, 0, 2}), own = map.add_point(b, 3, {0, 0, 2.1});
  map.add_observation(p, {b, 3, /*loop=*/7});
  EXPECT_EQ(map.keyframes[1].points[3], own) << "the feature keeps its own point";
  EXPECT_EQ(map.keyframes[0].covisible.at(b), 1);
  map.remove_loop(6);
  EXPECT_EQ(map.keyframes[0].covisible.at(b), 1);
  map.remove_loop(7);
  EXPECT_TRUE(map.keyframes[0].covisible.empty());
  EXPECT_EQ(map.points[0].observations.size(), 1u);
  EXPECT_EQ(map.keyframes[1].points[3], own);
}

TEST(Map, WhatALoopConnectsIsNotTracked) {
  Map map;
  const int a = add(map, at(0, 0, 0)), b = add(map, at(1, 0, 0)), c = add(map, at(2, 0, 0));
  const int p = map.add_point(a, 0, {0, 0, 2}), q = map.add_point(a, 1, {1, 0, 2});
  map.add_observation(p, {b, 4});
  map.add_observation(q, {c, 5, /*loop=*/7});
  EXPECT_EQ(map.keyframes[0].covisible, (std::map<int, int>{{b, 1}, {c, 1}}));
  EXPECT_EQ(map.tracked_covisible(a), (std::map<int, int>{{b, 1}}));
  EXPECT_EQ(map.tracked_covisible(b), (std::map<int, int>{{a, 1}}));
  EXPECT_EQ(map.tracked_covisible(c), (std::map<int, int>{}));
}

TEST(Map, PointsSeenOnceAreRemovedAfterATrial) {
  Map map;
  for (int k = 0; k < 5; ++k) add(map, at(k, 0, 0));
  const int lonely = map.add_point(0, 0, {0, 0, 2}), seen = map.add_point(0, 1, {0, 0, 2}),
            young = map.add_point(3, 0, {0, 0, 2});
  map.add_observation(seen, {1, 0});
  map.cull(4);
  EXPECT_TRUE(map.points[static_cast<std::size_t>(lonely)].bad);
  EXPECT_FALSE(map.points[static_cast<std::size_t>(seen)].bad);
  EXPECT_FALSE(map.points[static_cast<std::size_t>(young)].bad);
}

/// Twelve keyframes around a circle that tracking does not close: it turns 0.01 too far at each
/// step.
struct Drift {
  Map map;
  KeyframeGraph graph;
  std::vector<Eigen::Isometry3d> truth, tracked;
  Drift() {
    for (int k = 0; k < 12; ++k) {
      const double angle = 6.2831853 * k / 12;
      truth.push_back(at(2 * std::sin(angle), 0, 2 * std::cos(angle), angle));
      Eigen::Isometry3d pose = truth.back();
      if (k > 0) {
        Eigen::Isometry3d motion = truth[static_cast<std::size_t>(k) - 1].inverse() * truth.back();
        motion.linear() = motion.linear() * Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY());
        pose = tracked.back() * motion;
      }
      tracked.push_back(pose);
      add(map, pose);
      map.add_point(k, 0, pose * Eigen::Vector3d(0, 0, 1));
      graph.record(map);
    }
  }
  RelativePose closing() const {
    return {0, 11, truth.front().inverse() * truth.back(), information_of(0.001, 0.001)};
  }
};

TEST(KeyframeGraph, ALoopSpreadsTheDriftAndMovesThePoints) {
  Drift d;
  const double before = (d.tracked.back().translation() - d.truth.back().translation()).norm();
  ASSERT_GT(before, 0.1);
  d.graph.add(0, {d.closing()});
  EXPECT_EQ(d.graph.optimize(d.map), "");
  for (std::size_t k = 0; k < 12; ++k) {
    const Eigen::Isometry3d& pose = d.map.keyframes[k].world_from_camera;
    EXPECT_LT((pose.translation() - d.truth[k].translation()).norm(), 0.3 * before) << k;
    EXPECT_LT((d.map.points[k].position - pose * Eigen::Vector3d(0, 0, 1)).norm(), 1e-9)
        << "the point follows its keyframe";
  }
  EXPECT_LT(
      (d.map.keyframes[11].world_from_camera.translation() - d.truth[11].translation()).norm(),
      0.1 * before);
}

TEST(KeyframeGraph, ARetractionIsUndone) {
  Drift d;
  Drift wrong;
  wrong.graph.add(0, {{2, 9, at(0, 0, 0), information_of(0.01, 0.01)}});
  wrong.graph.optimize(wrong.map);
  ASSERT_GT(
      (wrong.map.keyframes[9].world_from_camera.translation() - d.tracked[9].translation()).norm(),
      0.1)
      << "a false loop bends the map";
  wrong.graph.remove(0);
  wrong.graph.optimize(wrong.map);
  for (std::size_t k = 0; k < 12; ++k) {
    // The minimum is exact: all odometry agrees. The optimiser stops at relative steps of 1e-7.
    EXPECT_TRUE(wrong.map.keyframes[k].world_from_camera.isApprox(d.tracked[k], 1e-4)) << k;
  }
}

TEST(KeyframeGraph, ALoopThatOthersContradictIsAMisfit) {
  Drift d;
  d.graph.add(3, {d.closing()});
  const Eigen::Isometry3d true_pose = d.truth[2].inverse() * d.truth[9];
  d.graph.add(4, {{2, 9, true_pose * at(0.3, 0, 0), information_of(0.05, 0.05)}});
  d.graph.optimize(d.map);
  EXPECT_EQ(d.graph.misfits(d.map, 0.1, 0.05), (std::vector<int>{4}));
  EXPECT_EQ(d.graph.misfits(d.map, 0.5, 0.5), (std::vector<int>{}));
  d.graph.remove(4);
  d.graph.add(
      5, {{2, 9, true_pose, information_of(0.05, 0.05)},
          {3, 8, d.truth[3].inverse() * d.truth[8] * at(0, 0, 0, 0.2), information_of(0.5, 0.05)}});
  d.graph.optimize(d.map);
  EXPECT_EQ(d.graph.misfits(d.map, 0.1, 0.05), (std::vector<int>{5})) << "one edge suffices";
}

TEST(KeyframeGraph, TheWorstMisfitComesFirst) {
  Drift d;
  const auto loop = [&](int a, int b, const Eigen::Isometry3d& error) {
    return std::vector<RelativePose>{
        {a, b,
         d.map.keyframes[static_cast<std::size_t>(a)].world_from_camera.inverse() *
             d.map.keyframes[static_cast<std::size_t>(b)].world_from_camera * error,
         information_of(0.01, 0.01)}};
  };
  d.graph.add(1, loop(0, 5, at(0.15, 0, 0)));        // 1.5 bounds
  d.graph.add(2, loop(1, 6, at(0, 0, 0, 0.2)));      // 4 bounds
  d.graph.add(3, loop(2, 7, at(0.09, 0, 0, 0.04)));  // fits
  d.graph.add(4, loop(3, 8, at(0.2, 0, 0, 0.01)));   // 2 bounds
  EXPECT_EQ(d.graph.misfits(d.map, 0.1, 0.05), (std::vector<int>{2, 4, 1}));
}

// Loops that a wrong one bends the map away from fit again without it.
TEST(KeyframeGraph, WithoutTheWorstMisfitCorrectLoopsFit) {
  Drift d;
  const auto loop = [&](std::size_t a, std::size_t b, const Eigen::Isometry3d& error) {
    return std::vector<RelativePose>{{static_cast<int>(a), static_cast<int>(b),
                                      d.truth[a].inverse() * d.truth[b] * error,
                                      information_of(0.01, 0.01)}};
  };
  d.graph.add(1, loop(0, 11, at(0, 0, 0)));
  d.graph.add(2, loop(1, 10, at(0, 0, 0)));
  d.graph.add(3, loop(2, 9, at(2, 0, 0)));
  d.graph.optimize(d.map);
  EXPECT_EQ(d.graph.misfits(d.map, 0.1, 0.05), (std::vector<int>{3, 2}));
  d.graph.remove(3);
  d.graph.optimize(d.map);
  EXPECT_EQ(d.graph.misfits(d.map, 0.1, 0.05), (std::vector<int>{}));
}

// A keyframe that lost the points it shared with its neighbours would follow one loop alone.
TEST(KeyframeGraph, OdometryHoldsSuccessiveKeyframesThatShareFewPoints) {
  Map map;
  KeyframeGraph graph;
  const Eigen::Isometry3d motion = at(0.1, 0, 0, 0.02);
  for (const auto& [pose, session] : {std::pair{at(0, 0, 0), 0}, std::pair{motion, 0},
                                      std::pair{motion * motion, 0}, std::pair{at(5, 0, 0), 1}}) {
    add(map, pose, session, 100);
    graph.record(map);
  }
  for (int k = 0; k < 60; ++k) map.add_observation(map.add_point(0, k, {0, 0, 2}), {1, k});
  map.keyframes[2].world_from_camera = at(1, 0, 0);  // a loop moved it
  const auto weak = graph.weak_odometry(map);
  ASSERT_EQ(weak.size(), 1u) << "60 points hold 0 and 1; 2 and 3 are of two sessions";
  EXPECT_EQ(weak[0].a, 1);
  EXPECT_EQ(weak[0].b, 2);
  EXPECT_TRUE(weak[0].a_from_b.isApprox(motion, 1e-12)) << "as tracking measured it";
  map.remove_point(0);
  EXPECT_EQ(graph.weak_odometry(map).size(), 2u) << "59 points do not";
}

TEST(KeyframeGraph, SessionsKeepTheirWorldsUntilALoopMergesThem) {
  Map map;
  KeyframeGraph graph;
  for (int k = 0; k < 3; ++k) {
    add(map, at(k, 0, 0), 0);
    graph.record(map);
  }
  for (int k = 0; k < 3; ++k) {
    add(map, at(k, 0, 0), 1);
    graph.record(map);
  }
  EXPECT_EQ(graph.world_of_session(map), (std::vector<int>{0, 1}));
  graph.add(0, {{1, 4, at(0, 5, 0), information_of(0.01, 0.01)}});
  EXPECT_EQ(graph.world_of_session(map), (std::vector<int>{0, 0}));
  graph.optimize(map);
  for (int k = 0; k < 3; ++k)
    EXPECT_TRUE(map.keyframes[static_cast<std::size_t>(3 + k)].world_from_camera.isApprox(
        at(k, 5, 0), 1e-5));
  graph.remove(0);
  EXPECT_EQ(graph.world_of_session(map), (std::vector<int>{0, 1}));
}

TEST(Bundle, RecoversPosesAndPoints) {
  // Three cameras before twelve points; the measurements are exact, the start is not.
  const Pinhole camera;
  Map map;
  const std::vector<Eigen::Isometry3d> truth = {at(0, 0, 0), at(0.3, 0, 0, -0.05),
                                                at(0.6, 0.05, 0.1, -0.1)};
  std::vector<Eigen::Vector3d> points;
  for (int k = 0; k < 12; ++k)
    points.emplace_back(0.3 + 0.5 * std::sin(2.0 * k), 0.4 * std::cos(3.0 * k), 2 + 0.3 * (k % 4));
  for (std::size_t c = 0; c < truth.size(); ++c) {
    auto seen = features(points.size());
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Eigen::Vector3d p = truth[c].inverse() * points[k];
      const Eigen::Vector2d pixel = camera.project(p);
      seen->keys[k].pt = cv::Point2f(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
      seen->depth[k] = static_cast<float>(p.z());
    }
    Keyframe keyframe;
    keyframe.world_from_camera = truth[c] * (c == 0 ? at(0, 0, 0) : at(0.01, -0.02, 0.01, 0.01));
    keyframe.features = seen;
    map.add_keyframe(keyframe);
    for (std::size_t k = 0; k < points.size(); ++k) {
      if (c == 0)
        map.add_point(0, static_cast<int>(k), points[k] + Eigen::Vector3d(0.01, 0, -0.02));
      else
        map.add_observation(static_cast<int>(k), {static_cast<int>(c), static_cast<int>(k)});
    }
  }
  BundleProblem problem = bundle_of(map, {1, 2}, {0}, {});
  ASSERT_EQ(problem.sights.size(), 36u);
  const BundleReport report = adjust(camera, problem, 50, 1);
  EXPECT_LT(report.final_cost, 1e-3 * report.initial_cost);
  apply(camera, problem, map);
  for (std::size_t c = 0; c < truth.size(); ++c)  // pixels and depths are floats: about 1e-5
    EXPECT_TRUE(map.keyframes[c].world_from_camera.isApprox(truth[c], 1e-3)) << c;
  EXPECT_LT((map.points[5].position - points[5]).norm(), 1e-3);
}

}  // namespace
}  // namespace slam_demo
