// SPDX-License-Identifier: BSD-3-Clause
// Perceptual aliases by real registrations: a room, a hall that looks different, a twin of the
// room.
#include <gtest/gtest.h>

#include "loop_closure/scans.hpp"

namespace gpureg::test {
namespace {

constexpr double kApart = 12;  ///< metres between the room and its twin

/// 0: the room. 1, 2: the hall. 3, 4: the twin. 5, 6: the hall again. 7: the room again.
const Scans& walk() {
  static const Scans scans = [] {
    const auto room = [](double dx, double turn) {
      return Place{planar(dx, 0.4 * dx, turn), Pose::Identity(), false};
    };
    const auto hall = [](double dx, double turn) {
      return Place{planar(0.5 * kApart + dx, 0.2, turn), planar(0.5 * kApart, 0, 15), true};
    };
    const auto twin = [](double dx, double turn) {
      return Place{planar(kApart + dx, 0.1, turn), planar(kApart, 0, 0), false};
    };
    return Scans({room(0.3, 5), hall(0, 10), hall(0.6, -20), twin(0.2, 30), twin(0.5, 50),
                  hall(0.4, 170), hall(-0.2, 200), room(0.5, 190)});
  }();
  return scans;
}

TEST(TwinRooms, AConfidentWrongLoopIsNotAcceptedAgainstGoodOdometry) {
  const Context context = Context::cpu(2);
  LoopCloser closer(context, quick_options());
  walk().add_to(closer, context, 0, 5);
  // An image that looks the same; the closer itself sees that nothing overlaps.
  closer.propose(3, 0);
  closer.propose(4, 0);
  closer.process();
  for (const FragmentId source : {3, 4}) {
    const Loop alias = loop_of(closer.loops(), source, 0);
    EXPECT_GT(alias.confidence, 0.9);
    EXPECT_GT(alias.drift_ratio, 2);
    EXPECT_EQ(alias.state, LoopState::candidate);
    EXPECT_EQ(alias.reason, LoopReason::exceeds_drift);
  }
  // The way back closes true loops beside the aliases.
  walk().add_to(closer, context, 5, 8);
  closer.process();
  EXPECT_EQ(loop_of(closer.loops(), 7, 0).state, LoopState::accepted);
  for (const FragmentId source : {3, 4})
    EXPECT_EQ(loop_of(closer.loops(), source, 0).state, LoopState::candidate);
  EXPECT_LT(relative_error(closer.poses(), walk().s, 7, 0), 0.03);
  EXPECT_LT(relative_error(closer.poses(), walk().s, 3, 0), 0.5);  // drift over 24 m
}

TEST(TwinRooms, AnAcceptedOneIsRetractedOnTheWayBack) {
  const Context context = Context::cpu(2);
  LoopCloser closer(context, quick_options());
  const Scans& scans = walk();
  scans.add_to(closer, context, 0, 3);
  // Tracking is lost at the door of the twin: the host knows the position to some metres.
  scans.add(closer, context, 3);
  UnalignedMatrix6d lost = UnalignedMatrix6d::Identity() * 0.01;
  lost.bottomRightCorner<3, 3>() = 25 * Eigen::Matrix3d::Identity();
  closer.add_odometry(3, 2, scans.s.odometry[2].inverse() * scans.s.odometry[3], lost);
  closer.propose(3, 0);
  const Update before = closer.process();
  const Loop alias = loop_of(before.changed, 3, 0);
  EXPECT_GT(alias.confidence, 0.9);
  EXPECT_EQ(alias.state, LoopState::accepted);
  EXPECT_NEAR(relative_error(closer.poses(), scans.s, 3, 0), kApart, 0.5);
  // Three fragments later the hall is recognised, and the event arrives.
  scans.add_to(closer, context, 4, 7);
  for (const FragmentId target : {1, 2}) {
    closer.propose(5, target);
    closer.propose(6, target);
  }
  const Update after = closer.process();
  const Loop retracted = loop_of(after.changed, 3, 0);
  EXPECT_EQ(retracted.state, LoopState::retracted);
  EXPECT_EQ(retracted.reason, LoopReason::inconsistent);
  EXPECT_EQ(loop_of(closer.loops(), 5, 1).state, LoopState::accepted);
  EXPECT_LT(relative_error(closer.poses(), scans.s, 3, 0), 0.5);
}

// As before, but the neighbours of the twin see another room (the mirror image) at its place.
TEST(TwinRooms, NeighboursThatCannotBeThereRefuseAnAlias) {
  const Context context = Context::cpu(2);
  LoopCloser closer(context, quick_options());
  const Scans scans({{planar(0.3, 0.1, 5), Pose::Identity(), false},
                     {planar(0.9, 0.3, 25), Pose::Identity(), false},
                     {planar(6, 0.2, 10), planar(6, 0, 15), true},
                     {planar(12.2, 0.1, 30), planar(12, 0, 0), false},
                     {planar(12.7, 0.2, 50), planar(15, 0, 0), true},
                     {planar(13.1, 0.1, 65), planar(15, 0, 0), true}});
  scans.add_to(closer, context, 0, 3);
  scans.add(closer, context, 3);
  UnalignedMatrix6d lost = UnalignedMatrix6d::Identity() * 0.01;
  lost.bottomRightCorner<3, 3>() = 25 * Eigen::Matrix3d::Identity();
  closer.add_odometry(3, 2, scans.s.odometry[2].inverse() * scans.s.odometry[3], lost);
  for (int k = 4; k < 6; ++k) {
    const auto at = static_cast<std::size_t>(k);
    scans.add(closer, context, k);
    closer.add_odometry(k, k - 1, scans.s.odometry[at - 1].inverse() * scans.s.odometry[at]);
  }
  closer.propose(3, 0);
  closer.process();
  const Loop alias = loop_of(closer.loops(), 3, 0);
  EXPECT_LT(alias.confidence, 0.5);
  EXPECT_NE(alias.state, LoopState::accepted) << to_string(alias.reason);
}

}  // namespace
}  // namespace gpureg::test
