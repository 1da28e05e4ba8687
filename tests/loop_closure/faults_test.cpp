// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "loop_closure/drive.hpp"
#include "support/expect_error.hpp"

namespace gpureg::test {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

class LoopCloserFaults : public testing::Test {
 protected:
  LoopCloserFaults() : closer(closer_of()), s(sequence(square(20))) {
    s.add_to(closer);
    before = (closer.process(), bytes_of(closer));
  }

  /// The call throws, names what is wrong, and changes nothing.
  template <typename Action>
  void refused(const Action& action, std::initializer_list<std::string> named) {
    expect_error<InvalidArgument>(action, named);
    closer.process();
    EXPECT_EQ(bytes_of(closer), before);
  }

  LoopCloser closer;
  Sequence s;
  std::string before;
};

TEST_F(LoopCloserFaults, UnknownRepeatedAndEqualIds) {
  refused([&] { closer.add({7}); }, {"fragment 7", "before"});
  refused([&] { closer.add_odometry(3, 99, Pose::Identity()); }, {"fragment 99"});
  refused([&] { closer.add_odometry(3, 2, Pose::Identity()); }, {"3", "2", "before"});
  refused([&] { closer.add_odometry(2, 3, Pose::Identity()); }, {"3", "2", "before"});
  refused([&] { closer.add_loop(4, 4, Pose::Identity()); }, {"same fragment 4"});
  refused([&] { closer.add_result(5, 98, {}); }, {"fragment 98"});
  refused([&] { closer.propose(97, 5); }, {"fragment 97"});
  refused([&] { closer.propose(6, 5); }, {"fragment 6 has no cloud"});
  refused([&] { closer.set_covisible(5, {6, 96}); }, {"fragment 96"});
  refused([&] { closer.remove(95); }, {"fragment 95"});
  refused([&] { closer.set_poses({{3, Pose::Identity()}, {94, Pose::Identity()}}); },
          {"fragment 94"});
  refused([&] { closer.set_poses({{3, Pose::Identity()}, {3, Pose::Identity()}}); },
          {"fragment 3 twice"});
}

TEST_F(LoopCloserFaults, NumbersThatAreNone) {
  Pose pose = Pose::Identity();
  pose.translation().x() = kNaN;
  refused([&] { closer.add({50, 0, 0, {}, pose}); }, {"fragment 50", "not finite"});
  refused([&] { closer.add({50, 0, kNaN}); }, {"time of fragment 50"});
  refused([&] { closer.add({50, 0, 0, {}, Pose::Identity(), Eigen::Vector3d::Zero()}); },
          {"up of fragment 50"});
  refused([&] { closer.add_odometry(5, 1, pose); }, {"target_from_source"});
  refused([&] { closer.add_loop(5, 1, pose); }, {"target_from_source"});
  refused([&] { closer.add_loop(5, 1, Pose::Identity(), std::nullopt, 1.5); },
          {"confidence", "1.5"});
  refused([&] { closer.set_poses({{5, pose}}); }, {"fragment 5"});
  RegistrationResult result = result_of(Pose::Identity(), 0.9);
  result.modes.push_back(result.modes[0]);
  result.modes[1].target_from_source = pose;
  refused([&] { closer.add_result(5, 1, result); }, {"result.modes[1]"});
  Pose scaled = Pose::Identity();
  scaled.linear() *= 1.1;
  refused([&] { closer.add_loop(5, 1, scaled); }, {"not rigid"});
  refused([&] { closer.process(kNaN); }, {"milliseconds"});
}

TEST_F(LoopCloserFaults, CovariancesThatAreNone) {
  UnalignedMatrix6d m = UnalignedMatrix6d::Identity();
  m(2, 2) = -1;
  refused([&] { closer.add_odometry(5, 1, Pose::Identity(), m); },
          {"covariance", "positive definite"});
  refused([&] { closer.add_loop(5, 1, Pose::Identity(), m); }, {"information", "semi-definite"});
  m(2, 2) = kNaN;
  refused([&] { closer.add_odometry(5, 1, Pose::Identity(), m); }, {"covariance", "not finite"});
  m(2, 2) = 1;
  m(0, 5) = 3;
  refused([&] { closer.add_odometry(5, 1, Pose::Identity(), m); }, {"covariance", "symmetric"});
  m.setZero();
  refused([&] { closer.add_loop(5, 1, Pose::Identity(), m); }, {"information", "zero"});
}

TEST_F(LoopCloserFaults, OptionsOutOfRange) {
  loop_closure::Options options;
  options.modes = 0;
  expect_error<InvalidArgument>([&] { closer_of(options); }, {"modes", "0"});
  options = {};
  options.acceptance.alone = 1.2;
  expect_error<InvalidArgument>([&] { closer_of(options); }, {"acceptance.alone", "1.2"});
  options = {};
  options.proposals.min_overlap = 0;
  expect_error<InvalidArgument>([&] { closer_of(options); }, {"proposals.min_overlap", "0"});
  options = {};
  options.drift_correlation = -1;
  expect_error<InvalidArgument>([&] { closer_of(options); }, {"drift_correlation", "-1"});
}

TEST(LoopCloserStates, WithoutOdometryEveryFragmentIsAFrameOfItsOwn) {
  LoopCloser closer = closer_of();
  const Sequence s = sequence(square(6));
  for (int k = 0; k < 6; ++k) closer.add({k, 0, 0, {}, s.odometry[static_cast<std::size_t>(k)]});
  for (const loop_closure::FragmentPose& pose : closer.process().poses)
    EXPECT_EQ(pose.frame, pose.id);
  // One loop between two fragments is never enough, however confident.
  add_correct(closer, s, 1, 0, 0.99);
  closer.process();
  EXPECT_EQ(closer.loops().at(0).state, LoopState::candidate);
  EXPECT_EQ(closer.loops().at(0).reason, LoopReason::unconfirmed);
}

TEST(LoopCloserStates, WhatIsStoppedGoesOnLater) {
  LoopCloser closer = closer_of(), other = closer_of();
  const Sequence s = sequence(square(40));
  for (LoopCloser* c : {&closer, &other}) {
    s.add_to(*c);
    for (int k = 20; k < 40; k += 3) add_correct(*c, s, k, k - 20, 0.8);
  }
  loop_closure::ProcessLimits stopped;
  stopped.should_stop = [] { return true; };
  closer.process(stopped);
  closer.process();
  other.process();
  EXPECT_EQ(bytes_of(closer), bytes_of(other));
}

}  // namespace
}  // namespace gpureg::test
