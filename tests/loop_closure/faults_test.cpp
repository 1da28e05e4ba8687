// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <limits>

#include "loop_closure/drive.hpp"
#include "support/expect_error.hpp"
#include "support/scan.hpp"

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
  Pose mirrored = Pose::Identity();
  mirrored.linear().diagonal() << 1, 1, -1;
  refused([&] { closer.add_loop(5, 1, mirrored); }, {"target_from_source", "mirror image"});
  Pose projective = Pose::Identity();
  projective.matrix()(3, 3) = 2;
  refused([&] { closer.add_loop(5, 1, projective); }, {"target_from_source", "last row"});
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

TEST_F(LoopCloserFaults, NumbersThatAPoseGraphDoesNotTake) {
  const Pose far = planar(1e150, 0, 0);
  refused([&] { closer.add({50, 0, 0, {}, far}); }, {"fragment 50", "1e+150", "1e9"});
  refused([&] { closer.add_odometry(5, 1, far); }, {"target_from_source", "1e+150"});
  refused([&] { closer.add_loop(5, 1, far); }, {"target_from_source", "1e+150"});
  refused([&] { closer.set_poses({{5, far}}); }, {"fragment 5", "1e+150"});
  refused([&] { closer.add({50, 0, 0, {}, Pose::Identity(), Eigen::Vector3d(0, 0, 1e-9)}); },
          {"up of fragment 50", "1e-09"});
  const UnalignedMatrix6d unit = UnalignedMatrix6d::Identity();
  refused([&] { closer.add_odometry(5, 1, Pose::Identity(), unit * 1e307); },
          {"covariance", "1e+307"});
  refused([&] { closer.add_odometry(5, 1, Pose::Identity(), unit * 1e-20); },
          {"covariance", "1e-20"});
  refused([&] { closer.add_loop(5, 1, Pose::Identity(), unit * 1e20); }, {"information", "1e+20"});
  refused([&] { closer.add_loop(5, 1, Pose::Identity(), unit * 1e-30); }, {"information", "1e-30"});
}

TEST_F(LoopCloserFaults, CloudsOfAnotherVoxelSizeOrWithoutPoints) {
  const Context context = Context::cpu(1);
  const std::vector<Eigen::Vector3f> nothing(7, Eigen::Vector3f::Constant(float(kNaN)));
  refused([&] { closer.add({50, 0, 0, prepare(context, PointCloudView(nothing))}); },
          {"fragment 50", "no points", "7"});
  std::mt19937 random(5);
  const std::vector<Eigen::Vector3f> points = scan_room(random);
  refused(
      [&] {
        closer.add({50, 0, 0, prepare(context, PointCloudView(points), RegistrationOptions{0.5f})});
      },
      {"fragment 50", "0.5 m", "0.05 m"});
}

TEST_F(LoopCloserFaults, ResultsThatAreNone) {
  const RegistrationResult good = result_of(Pose::Identity(), 0.9);
  RegistrationResult result = good;
  result.confidence = kNaN;
  refused([&] { closer.add_result(5, 1, result); }, {"result.confidence", "nan"});
  result = good;
  result.modes[0].confidence = 1.5;
  refused([&] { closer.add_result(5, 1, result); }, {"result.modes[0].confidence", "1.5"});
  result = good;
  result.modes[0].evidence.information_eigenvalues = {1, 1, 1, 1, 1, 1};
  result.modes[0].evidence.weakest_direction[0] = kNaN;
  refused([&] { closer.add_result(5, 1, result); }, {"result.modes.information", "nan"});
}

TEST(LoopCloserStates, NoiseOfOptionsThatIsTooSmallIsRefusedWhereItIsUsed) {
  loop_closure::Options options;
  options.graph.drift.min_translation = 1e-12;
  options.host_noise.translation = 2e-11;  // of voxels of 5 cm
  LoopCloser closer = closer_of(options);
  for (int k = 0; k < 2; ++k) closer.add({k});
  expect_error<InvalidArgument>([&] { closer.add_odometry(1, 0, Pose::Identity()); },
                                {"graph.drift", "1e+24"});
  expect_error<InvalidArgument>([&] { closer.add_loop(1, 0, Pose::Identity()); },
                                {"host_noise", "e+2"});
  closer.add_odometry(1, 0, planar(1, 0, 0));  // was not taken
  EXPECT_EQ(closer.process().poses.size(), 2u);
}

TEST(LoopCloserStates, LongChainsOfRoundedRotationsStayRigid) {
  for (const bool optimize : {true, false}) {
    loop_closure::Options options;
    options.optimize = optimize;
    LoopCloser closer = closer_of(options);
    Pose step = planar(1, 0, 3);
    step.linear() *= 1 + 4e-5;  // as inexact as add_odometry() takes
    for (int k = 0; k < 60; ++k) {
      closer.add({k});
      if (k > 0) closer.add_odometry(k, k - 1, step);
      if (k > 2 && k % 3 == 0) closer.remove(k - 2);
    }
    closer.add_result(59, 0, result_of(Pose::Identity(), 0.9));
    EXPECT_NO_THROW(closer.process());
    for (const loop_closure::FragmentPose& pose : closer.poses()) {
      const Eigen::Matrix3d r = pose.world_from_fragment.linear();
      // Two such steps: what a pose graph takes is 1e-3.
      EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 5e-4);
    }
  }
}

TEST(LoopCloserStates, OdometryOfAnySizeEnds) {
  LoopCloser closer = closer_of();
  for (int k = 0; k < 12; ++k) closer.add({k});
  for (int k = 1; k < 12; ++k) {
    const double size = k % 2 == 0 ? 1e18 : 1e-18;
    closer.add_odometry(k, k - 1, planar(k % 3 == 0 ? 1e9 : 0, k % 3 == 1 ? -1e9 : 1e-9, 77.0 * k),
                        UnalignedMatrix6d(UnalignedMatrix6d::Identity() * size));
  }
  for (int k = 4; k < 12; ++k)
    closer.add_result(k, k - 4, result_of(planar(1e9, double(k), 0), 0.9));
  EXPECT_NO_THROW(closer.process());
  closer.remove(5);
  closer.remove(6);
  EXPECT_NO_THROW(closer.process());
  for (const loop_closure::FragmentPose& pose : closer.poses())
    EXPECT_TRUE(pose.world_from_fragment.matrix().allFinite());
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
  options.gravity_sigma = 1e-7;
  expect_error<InvalidArgument>([&] { closer_of(options); }, {"gravity_sigma", "1e-07"});
  options = {};
  options.drift_correlation = -1;
  expect_error<InvalidArgument>([&] { closer_of(options); }, {"drift_correlation", "-1"});
}

TEST(LoopCloserStates, WithoutPosesAndOdometryEveryFragmentIsAFrameOfItsOwn) {
  LoopCloser closer = closer_of();
  const Sequence s = sequence(square(6));
  for (int k = 0; k < 6; ++k) closer.add({k});
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
  const Update update = closer.process(stopped);
  EXPECT_EQ(update.status, pose_graph::Status::cancelled);
  EXPECT_FALSE(update.reason.empty());
  // Nothing is decided yet.
  ASSERT_EQ(update.changed.size(), 7u);
  for (const Loop& loop : update.changed) {
    EXPECT_EQ(loop.state, LoopState::candidate);
    EXPECT_EQ(loop.reason, LoopReason::unconfirmed);
  }
  EXPECT_EQ(closer.process().status, pose_graph::Status::converged);
  other.process();
  EXPECT_EQ(bytes_of(closer), bytes_of(other));
}

}  // namespace
}  // namespace gpureg::test
