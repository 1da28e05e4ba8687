// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/evaluation/trajectory.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "gpureg/error.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::test {
namespace {

using namespace evaluation;

StampedPose pose(double time, const Eigen::Vector3d& position, double degrees = 0) {
  StampedPose out;
  out.time = time;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  out.world_from_body.topLeftCorner<3, 3>() = turn;
  out.world_from_body.topRightCorner<3, 1>() = position;
  return out;
}

Trajectory square() {
  return {pose(0, {0, 0, 0}), pose(1, {1, 0, 0}), pose(2, {1, 1, 0}), pose(3, {0, 1, 0})};
}

Trajectory moved(Trajectory poses) {
  Eigen::Isometry3d motion = Eigen::Translation3d(3, -2, 5) *
                             Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized());
  for (StampedPose& p : poses) p.world_from_body = (motion.matrix() * p.world_from_body).eval();
  return poses;
}

/// Rounding of products of a few doubles of size 10.
constexpr double kRounding = 1e-12;

TEST(Trajectory, ARigidMotionIsNoError) {
  const TrajectoryEvaluation e = evaluate_trajectory(moved(square()), square());
  EXPECT_EQ(e.matched, 4u);
  EXPECT_NEAR(e.absolute_translation.max, 0, kRounding);
  EXPECT_NEAR(e.relative_translation.max, 0, kRounding);
  EXPECT_NEAR(e.absolute_rotation.max, 0, 1e-6);  // degrees: of an acos-like function near 0
  EXPECT_NEAR(e.path_length, 3, kRounding);
}

TEST(Trajectory, KnownErrors) {
  Trajectory estimate = square();
  estimate[2] = pose(2, {1, 1, 0.4}, 10);
  TrajectoryOptions options;
  options.align = false;
  const TrajectoryEvaluation e = evaluate_trajectory(estimate, square(), options);
  EXPECT_NEAR(e.absolute_translation.rmse, 0.2, kRounding);  // sqrt(.16 / 4)
  EXPECT_NEAR(e.absolute_translation.mean, 0.1, kRounding);
  EXPECT_EQ(e.absolute_translation.median, 0);
  EXPECT_NEAR(e.absolute_rotation.max, 10, 1e-9);
  // Steps 0-1, 1-2, 2-3: no error; .4 m up; .4 m down, and the step of -1 m along x seen from a
  // frame that is turned by 10 degrees.
  EXPECT_EQ(e.relative_translation.count, 3u);
  EXPECT_NEAR(e.relative_translation.min, 0, kRounding);
  const double chord = 2 * std::sin(5 * M_PI / 180);
  EXPECT_NEAR(e.relative_translation.max, std::sqrt(0.16 + chord * chord), kRounding);
  EXPECT_NEAR(e.relative_rotation.max, 10, 1e-9);
}

TEST(Trajectory, AlignmentKeepsTheScale) {
  Trajectory estimate = square();
  for (StampedPose& p : estimate) p.world_from_body.topRightCorner<3, 1>() *= 1.2;
  const TrajectoryEvaluation e = evaluate_trajectory(estimate, square());
  // Every corner of the square is a tenth of its diagonal too far from the centre.
  EXPECT_NEAR(e.absolute_translation.rmse, 0.1 * std::sqrt(2), kRounding);
  EXPECT_NEAR(Eigen::Matrix3d(e.truth_from_estimate.topLeftCorner<3, 3>()).determinant(), 1,
              kRounding);
}

TEST(Trajectory, StepsByLength) {
  TrajectoryOptions options;
  options.delta_unit = DeltaUnit::metres;
  options.delta = 1.5;
  EXPECT_EQ(evaluate_trajectory(square(), square(), options).relative_translation.count, 1u);
  options.delta = 10;
  EXPECT_EQ(evaluate_trajectory(square(), square(), options).relative_translation.count, 0u);
}

TEST(Trajectory, MatchesNearestTimesOnce) {
  Trajectory estimate = square();
  estimate[1].time = 1.008;  // nearer than the next one
  estimate.insert(estimate.begin() + 2, pose(1.009, {7, 7, 7}));
  estimate.push_back(pose(9, {7, 7, 7}));  // nothing near
  TrajectoryOptions options;
  options.max_difference = 0.02;
  const TrajectoryEvaluation e = evaluate_trajectory(estimate, square(), options);
  EXPECT_EQ(e.matched, 4u);
  EXPECT_NEAR(e.absolute_translation.max, 0, kRounding);
  options.max_difference = 0.001;
  EXPECT_EQ(evaluate_trajectory(estimate, square(), options).matched, 3u);
  options.max_difference = 0;
  expect_error<InvalidArgument>(
      [&] { evaluate_trajectory({pose(0.5, {0, 0, 0})}, square(), options); },
      {"0 of 1 poses", "3 or more"});
}

TEST(Trajectory, ReadsTheFormats) {
  const TemporaryFolder folder;
  const std::string tum =
      folder.write("a.tum",
                   "# time tx ty tz qx qy qz qw\n1.5 1 2 3 0 0 0.70710678118654752 "
                   "0.70710678118654752\n0.5 0 0 0 0 0 0 1\n");
  const std::string kitti =
      folder.write("a.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n0 -1 0 1 1 0 0 2 0 0 1 3\n");
  const std::string blocks = folder.write(
      "poses.txt",
      "0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n7\n0 -1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n");
  const std::string rows = folder.write(
      "rows.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0 -1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n");
  const Trajectory a = read_trajectory(tum), b = read_trajectory(kitti),
                   c = read_trajectory(blocks), d = read_trajectory(rows);
  ASSERT_EQ(a.size(), 2u);
  EXPECT_EQ(a[0].time, 0.5);  // sorted
  EXPECT_EQ(b[1].time, 1);
  EXPECT_EQ(c[1].time, 7);
  EXPECT_LT((a[1].world_from_body - b[1].world_from_body).cwiseAbs().maxCoeff(), kRounding);
  EXPECT_EQ(b[1].world_from_body, c[1].world_from_body);
  EXPECT_EQ(d[1].time, 1);
  EXPECT_EQ(d[1].world_from_body, c[1].world_from_body);
  expect_error<IoError>([&] { read_trajectory(kitti, TrajectoryFormat::tum); },
                        {"a.txt:1", "12 fields", "8"});
}

TEST(Trajectory, WrittenAndReadAgain) {
  const TemporaryFolder folder;
  Trajectory written = square();
  written[2].time = 1311868164.3633751;
  written[2].world_from_body.topLeftCorner<3, 3>() =
      Eigen::AngleAxisd(3.0, Eigen::Vector3d(0, 1, 1).normalized()).toRotationMatrix();
  std::sort(written.begin(), written.end(),
            [](const StampedPose& a, const StampedPose& b) { return a.time < b.time; });
  write_trajectory(folder / "t.txt", written);
  const Trajectory read = read_trajectory(folder / "t.txt");
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t k = 0; k < read.size(); ++k) {
    EXPECT_EQ(read[k].time, written[k].time);
    EXPECT_LT((read[k].world_from_body - written[k].world_from_body).cwiseAbs().maxCoeff(),
              kRounding);
  }
  written[1].world_from_body(0, 0) = 2;
  expect_error<InvalidArgument>([&] { write_trajectory(folder / "t.txt", written); },
                                {"time 1", "not rigid"});
}

TEST(Trajectory, ErrorsOfThePoses) {
  Trajectory estimate = square();
  estimate[2].world_from_body(2, 3) += 0.25;
  TrajectoryOptions options;
  options.align = false;
  const TrajectoryEvaluation e = evaluate_trajectory(estimate, square(), options);
  ASSERT_EQ(e.poses.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(e.poses[k].time, estimate[k].time);
    EXPECT_NEAR(e.poses[k].metres, k == 2 ? 0.25 : 0, kRounding);
  }
}

TEST(Trajectory, ErrorsNameFileAndLine) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text, std::initializer_list<std::string> parts) {
    const std::string path = folder.write("bad.txt", text);
    expect_error<IoError>([&] { read_trajectory(path); }, parts);
  };
  refused("", {"bad.txt", "no pose"});
  refused("1 2 3\n", {"bad.txt:1", "3 fields"});
  refused("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 nan\n", {"bad.txt:2"});
  refused("0 0 0 0 0 0 0 2\n", {"bad.txt:1", "quaternion"});
  refused("0 0 0 0 0 0 0 1\n0 1 0 0 0 0 0 1\n", {"bad.txt", "time 0", "twice"});
  refused("2 0 0 0 0 1 0 0 0 0 1 0\n", {"bad.txt:1", "rotation"});
  refused("0\n1 0 0 0\n0 1 0 0\n", {"bad.txt", "ends within"});
  refused("1 0 0 0\n0 1 0 0\n", {"bad.txt", "ends within"});
  TrajectoryOptions options;
  options.delta = 0.5;
  expect_error<InvalidArgument>([&] { options.validate(); }, {"delta", "whole number"});
  options.max_difference = NAN;
  expect_error<InvalidArgument>([&] { options.validate(); }, {"max_difference"});
}

}  // namespace
}  // namespace gpureg::test
