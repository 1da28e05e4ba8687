// SPDX-License-Identifier: BSD-3-Clause
#include "steps.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <thread>

#include "background.hpp"
#include "mapping/keyframe_graph.hpp"

namespace slam_demo {
namespace {

constexpr double kLong = 1e9;  // milliseconds

class StepsOf : public ::testing::TestWithParam<bool> {};

TEST_P(StepsOf, WhatAStepAddsGoesBeforeTheRest) {
  Steps steps(GetParam());
  std::string done;
  double milliseconds = 0;
  steps.then([&] {
    done += 'a';
    steps.then([&] { done += 'b'; });
    steps.beside(
        milliseconds, [] { return 'c'; },
        [&](char c) {
          done += c;
          steps.then([&] { done += 'd'; });
        });
    steps.then([&] { done += 'e'; });
  });
  steps.then([&] { done += 'f'; });
  EXPECT_FALSE(steps.empty());
  EXPECT_EQ(done, "") << "nothing runs unasked";
  steps.finish();
  EXPECT_EQ(done, "abcdef");
  EXPECT_TRUE(steps.empty());
}

INSTANTIATE_TEST_SUITE_P(Parallel, StepsOf, ::testing::Bool());

TEST(Steps, DoNotWaitForTheOtherThread) {
  Steps steps(true);
  std::promise<void> go;
  double milliseconds = 0;
  std::thread::id other;
  bool done = false;
  steps.beside(
      milliseconds,
      [&, ready = go.get_future().share()] {
        ready.wait();
        return std::this_thread::get_id();
      },
      [&](std::thread::id id) {
        other = id;
        done = true;
      });
  steps.run(kLong);
  EXPECT_FALSE(done);
  go.set_value();
  steps.finish();
  EXPECT_TRUE(done);
  EXPECT_NE(other, std::this_thread::get_id());
}

TEST(Steps, EndWithTheBudgetUnlessNothingIsParallel) {
  for (const bool parallel : {true, false}) {
    Steps steps(parallel);
    int done = 0;
    for (int k = 0; k < 3; ++k) steps.then([&] { ++done; });
    steps.run(0);
    EXPECT_EQ(done, parallel ? 0 : 3);
  }
}

TEST(Background, KeepsTheOrderAndThrowsAtTheEnd) {
  for (const bool parallel : {true, false}) {
    Background background(parallel);
    std::string done;
    for (const char c : {'a', 'b', 'c'}) background.post([&done, c] { done += c; });
    background.drain();
    EXPECT_EQ(done, "abc");
  }
  Background background(true);
  background.post([] { throw std::runtime_error("x"); });
  EXPECT_THROW(background.drain(), std::runtime_error);
  background.drain();
}

// While a graph is optimised tracking goes on: its new keyframe and points keep their place
// relative to the newest keyframe that the graph knows.
TEST(KeyframeGraph, LaterKeyframesFollow) {
  Map map;
  const auto add = [&](int session, double x) {
    auto features = std::make_shared<Features>();
    features->keys.resize(1);
    features->descriptors.resize(1);
    features->depth = {1};
    features->index();
    Keyframe keyframe;
    keyframe.session = session;
    keyframe.world_from_camera.translation().x() = x;
    keyframe.features = features;
    const int index = map.add_keyframe(keyframe);
    map.add_point(index, 0, Eigen::Vector3d(x, 0, 1));
    return index;
  };
  add(0, 0);
  add(0, 1);
  add(1, 5);
  Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
  moved.translation() = Eigen::Vector3d(1.5, 0.2, 0);
  const Eigen::Isometry3d still = Eigen::Isometry3d::Identity();
  add(0, 2);
  add(2, 7);
  move_keyframes({still, moved, map.keyframes[2].world_from_camera}, map);
  const auto place = [&](std::size_t k) {
    return Eigen::Vector3d(map.keyframes[k].world_from_camera.translation());
  };
  EXPECT_LT((place(3) - Eigen::Vector3d(2.5, 0.2, 0)).norm(), 1e-12);
  EXPECT_LT((map.points[3].position - Eigen::Vector3d(2.5, 0.2, 1)).norm(), 1e-12);
  EXPECT_LT((place(4) - Eigen::Vector3d(7, 0, 0)).norm(), 1e-12) << "a session of its own";
}

}  // namespace
}  // namespace slam_demo
