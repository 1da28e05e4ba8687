// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "loop_closure/drive.hpp"

namespace gpureg::test {
namespace {

/// A walk through two rooms of equal furniture, `apart` metres from each other, and back into the
/// first one: fragments 0..4 in room 1, 10..14 in its twin, 20..24 in room 1 again.
Sequence twin_rooms(double apart = 8) {
  std::vector<Pose> truth;
  const auto room = [&](double x) {
    for (int k = 0; k < 5; ++k) truth.push_back(planar(x + 0.5 * k, 0.2 * k, 10.0 * k));
  };
  const auto corridor = [&](double from, double to) {
    for (int k = 0; k < 5; ++k) truth.push_back(planar(from + (to - from) * k / 5, 3, 0));
  };
  room(0);
  corridor(2, apart);
  room(apart);
  corridor(apart, 2);
  room(0);
  return sequence(truth);
}

/// The twin of a fragment in room 1 fits the fragment perfectly, with the pose of the twin room.
RegistrationResult alias(const Sequence& s, int source, int target) {
  const int original = source - 10;  // where the source seems to be
  return correct(s.truth[static_cast<std::size_t>(original)],
                 s.truth[static_cast<std::size_t>(target)], 0.97);
}

TEST(PerceptualAliases, ThoseThatAgreeWithEachOtherAreNotAcceptedAgainstGoodOdometry) {
  LoopCloser closer = closer_of();
  const Sequence s = twin_rooms();
  s.add_to(closer);
  for (int k = 10; k < 15; ++k)
    for (int t = 0; t < 5; ++t) closer.add_result(k, t, alias(s, k, t));
  closer.process();
  ASSERT_EQ(closer.loops().size(), 25u);
  for (const Loop& loop : closer.loops()) {
    EXPECT_EQ(loop.state, LoopState::candidate);
    EXPECT_EQ(loop.reason, LoopReason::exceeds_drift);
    EXPECT_GT(loop.drift_ratio, 2);
  }
  // The true revisit is believed.
  for (int k = 20; k < 25; ++k) add_correct(closer, s, k, k - 20, 0.97);
  closer.process();
  EXPECT_EQ(loop_of(closer.loops(), 22, 2).state, LoopState::accepted);
  EXPECT_EQ(loop_of(closer.loops(), 12, 2).state, LoopState::candidate);
  EXPECT_LT(relative_error(closer.poses(), s, 22, 2), 0.02);
}

TEST(PerceptualAliases, AnAcceptedOneIsRetractedWhenLoopsContradictIt) {
  LoopCloser closer = closer_of();
  Sequence s = twin_rooms();
  // Tracking was lost at the door of the twin room: the host knows the position to some metres.
  s.add_to(closer, 0, 10);
  closer.add({10, 0, 10.0, {}, s.odometry[10]});
  UnalignedMatrix6d lost = UnalignedMatrix6d::Identity();
  lost.bottomRightCorner<3, 3>() *= 25;
  closer.add_odometry(10, 9, s.odometry[9].inverse() * s.odometry[10], lost);
  s.add_to(closer, 11, 15);
  closer.add_result(12, 2, alias(s, 12, 2));
  const Update before = closer.process();
  ASSERT_EQ(before.changed.size(), 1u);
  EXPECT_EQ(before.changed[0].state, LoopState::accepted);
  EXPECT_GT(before.changed[0].confidence, 0.9);
  EXPECT_GT(relative_error(closer.poses(), s, 12, 2), 7);
  // It goes back through the corridor that it came by: within eight fragments the map is right.
  s.add_to(closer, 15, 20);
  for (int k = 16; k < 20; ++k) add_correct(closer, s, k, 24 - k, 0.9);
  const Update after = closer.process();
  const Loop retracted = loop_of(after.changed, 12, 2);
  EXPECT_EQ(retracted.state, LoopState::retracted);
  EXPECT_EQ(retracted.reason, LoopReason::inconsistent);
  EXPECT_EQ(retracted.weight, 0);
  EXPECT_EQ(loop_of(after.changed, 17, 7).state, LoopState::accepted);
  EXPECT_LT(relative_error(closer.poses(), s, 12, 2), 0.5);
}

TEST(PerceptualAliases, TrueLoopsAfterTwoMetresOfDriftAreAccepted) {
  LoopCloser closer = closer_of();
  Sequence s = sequence(square(40, 5, 7.5));
  s.odometry = drifted(s.truth, 0.9, 1.02);
  const double misclosure = ((s.odometry[0].inverse() * s.odometry[20]).translation() -
                             (s.truth[0].inverse() * s.truth[20]).translation())
                                .norm();
  EXPECT_GT(misclosure, 2);
  s.add_to(closer);
  for (int k = 20; k < 40; k += 2) add_correct(closer, s, k, k - 20, 0.8);
  closer.process();
  for (int k = 20; k < 40; k += 2)
    EXPECT_EQ(loop_of(closer.loops(), k, k - 20).state, LoopState::accepted) << k;
  for (int k = 20; k < 40; k += 2)
    EXPECT_LT(relative_error(closer.poses(), s, k, k - 20), 0.05);  // noise of two registrations
}

}  // namespace
}  // namespace gpureg::test
