// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "loop_closure/drive.hpp"
#include "loop_closure/scans.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::test {
namespace {

/// The same building, walked again from another place; the frame has nothing to do with the first.
Sequence second_session() {
  const std::vector<Pose> lap = square(20);
  std::vector<Pose> truth(lap.begin() + 7, lap.end());
  Sequence s = sequence(truth, 100, 1);
  const Pose elsewhere = planar(40, -7, 130);
  for (Pose& pose : s.odometry) pose = elsewhere * pose;
  return s;
}

/// Both sessions by odometry without drift, in the frame of the truth.
std::pair<Sequence, Sequence> exact_sessions() {
  Sequence first = sequence(square(20)), second = second_session();
  first.odometry = first.truth;
  second.odometry = second.truth;
  return {first, second};
}

std::size_t frames(const LoopCloser& closer) {
  std::set<FragmentId> found;
  for (const loop_closure::FragmentPose& pose : closer.poses()) found.insert(pose.frame);
  return found.size();
}

RegistrationResult between(const Sequence& a, int source, const Sequence& b, int target,
                           double confidence) {
  return correct(a.truth[static_cast<std::size_t>(source)],
                 b.truth[static_cast<std::size_t>(target)], confidence);
}

TEST(Sessions, TwoLoopsThatAgreeMergeThem) {
  LoopCloser closer = closer_of();
  const Sequence first = sequence(square(20)), second = second_session();
  first.add_to(closer);
  second.add_to(closer);
  closer.process();
  EXPECT_EQ(frames(closer), 2u);
  closer.add_result(102, 9, between(second, 2, first, 9, 0.97));
  closer.process();
  EXPECT_EQ(frames(closer), 2u) << "one is not enough";
  EXPECT_EQ(loop_of(closer.loops(), 102, 9).state, LoopState::candidate);
  closer.add_result(106, 13, between(second, 6, first, 13, 0.97));
  const Update update = closer.process();
  EXPECT_EQ(frames(closer), 1u);
  EXPECT_EQ(loop_of(update.changed, 102, 9).state, LoopState::accepted);
  EXPECT_EQ(loop_of(update.changed, 106, 13).reason, LoopReason::confirmed);
  // The second session came into the frame of the first.
  for (const loop_closure::FragmentPose& pose : closer.poses()) EXPECT_EQ(pose.frame, 0);
  const auto poses = closer.poses();
  EXPECT_EQ(poses[0].world_from_fragment.matrix(), first.odometry[0].matrix());
  const Pose found = poses[9].world_from_fragment.inverse() * poses[22].world_from_fragment;
  EXPECT_EQ(poses[22].id, 102);
  EXPECT_LT(found.translation().norm(), 0.05);
}

/// Poses without odometry.
void add_poses(LoopCloser& closer, const Sequence& s, int begin, int end) {
  for (int k = begin; k < end; ++k)
    closer.add({s.id(k), s.session, double(k), {}, s.odometry[static_cast<std::size_t>(k)]});
}

TEST(Sessions, ThePosesOfASessionAreItsOdometryWhereTheHostAddsNone) {
  LoopCloser by_poses = closer_of(), by_odometry = closer_of();
  const Sequence s = sequence(square(40));
  add_poses(by_poses, s, 0, 20);
  by_poses.process();
  add_poses(by_poses, s, 20, 40);
  s.add_to(by_odometry);
  for (LoopCloser* closer : {&by_poses, &by_odometry}) {
    for (int k = 20; k < 40; k += 3) add_correct(*closer, s, k, k - 20, 0.8);
    closer->process();
    EXPECT_EQ(frames(*closer), 1u);
    for (const Loop& loop : closer->loops()) EXPECT_EQ(loop.state, LoopState::accepted);
  }
  // The products of poses are rounded otherwise.
  EXPECT_NEAR(largest_error(by_poses.poses(), s), largest_error(by_odometry.poses(), s), 1e-6);
  EXPECT_LT(relative_error(by_poses.poses(), s, 39, 19), 0.05);
  // Removing a fragment keeps its neighbours connected.
  by_poses.remove(5);
  by_poses.process();
  EXPECT_EQ(frames(by_poses), 1u);
}

TEST(Sessions, OdometryOfTheHostReplacesThatOfThePoses) {
  const Sequence s = sequence(square(12));
  LoopCloser closer = closer_of(), loaded = closer_of(), other = closer_of();
  // process() comes between the fragments and their odometry.
  add_poses(closer, s, 0, 6);
  closer.process();
  EXPECT_EQ(closer.graph().edges.size(), 5u);
  const TemporaryFolder folder;
  closer.save(folder / "state");
  loaded.load(folder / "state", nullptr);
  s.add_to(other);
  other.process();
  for (LoopCloser* c : {&closer, &loaded}) {
    for (int k = 1; k < 6; ++k) {
      const auto at = static_cast<std::size_t>(k);
      c->add_odometry(k, k - 1, s.odometry[at - 1].inverse() * s.odometry[at]);
    }
    s.add_to(*c, 6, 12);
    c->process();
    EXPECT_EQ(c->graph().edges.size(), 11u);
    EXPECT_EQ(bytes_of(*c), bytes_of(other));
  }
  // Tracking that is lost says so by adding none.
  add_poses(closer, sequence(square(13)), 12, 13);
  closer.process();
  EXPECT_EQ(frames(closer), 2u);
}

TEST(Sessions, LoopsThatContradictEachOtherDoNotMergeThem) {
  LoopCloser closer = closer_of();
  const Sequence first = sequence(square(20)), second = second_session();
  first.add_to(closer);
  second.add_to(closer);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-5, 5), turn(-180, 180);
  for (int k = 0; k < 12; ++k) {
    const Pose wrong = planar(place(random), place(random), turn(random));
    closer.add_result(100 + k, (5 * k) % 20, result_of(wrong, 0.6));
  }
  closer.process();
  EXPECT_EQ(frames(closer), 2u);
  for (const Loop& loop : closer.loops()) EXPECT_NE(loop.state, LoopState::accepted);
}

TEST(Sessions, NearMissesAndScatteredRejectionsDoNotKeepThemApart) {
  LoopCloser closer = closer_of();
  const Sequence first = sequence(square(20)), second = second_session();
  first.add_to(closer);
  second.add_to(closer);
  for (int k = 0; k < 12; k += 2)
    closer.add_result(100 + k, k + 7, between(second, k, first, k + 7, 0.97));
  // A third of a metre off, each to another side, as registrations along a wall are.
  for (int k = 1; k < 12; k += 2) {
    const auto at = static_cast<std::size_t>(k);
    const Pose aside = planar(0.33 * std::cos(k), 0.33 * std::sin(k), 0);
    closer.add_result(100 + k, k + 7, correct(aside * second.truth[at], first.truth[at + 7], 0.95));
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-5, 5), turn(-180, 180);
  for (int k = 0; k < 12; ++k)
    closer.add_result(100 + k, k,
                      result_of(planar(place(random), place(random), turn(random)), 0.6));
  closer.process();
  EXPECT_EQ(frames(closer), 1u);
  for (int k = 0; k < 12; k += 2) {
    EXPECT_EQ(loop_of(closer.loops(), 100 + k, k + 7).state, LoopState::accepted) << k;
    EXPECT_NE(loop_of(closer.loops(), 100 + k, k).state, LoopState::accepted) << k;
  }
}

TEST(Sessions, AMergeByAliasesIsRetracted) {
  LoopCloser closer = closer_of();
  const auto [first, second] = exact_sessions();
  first.add_to(closer);
  second.add_to(closer, 0, 6);
  // Fragments 102 and 104 look as if they were five metres farther on.
  const Pose aside = planar(5, 0, 90);
  for (const int k : {2, 4}) {
    const Pose seems = aside * second.truth[static_cast<std::size_t>(k)];
    closer.add_result(100 + k, k, correct(seems, first.truth[static_cast<std::size_t>(k)], 0.95));
  }
  closer.process();
  EXPECT_EQ(frames(closer), 1u);
  EXPECT_EQ(loop_of(closer.loops(), 102, 2).state, LoopState::accepted);
  second.add_to(closer, 6);
  for (int k = 6; k < 13; ++k)
    closer.add_result(100 + k, k + 7, between(second, k, first, k + 7, 0.95));
  const Update update = closer.process();
  EXPECT_EQ(loop_of(update.changed, 102, 2).state, LoopState::retracted);
  EXPECT_EQ(loop_of(update.changed, 104, 4).state, LoopState::retracted);
  EXPECT_EQ(loop_of(update.changed, 108, 15).state, LoopState::accepted);
  EXPECT_EQ(frames(closer), 1u);
}

TEST(Sessions, LoopsOfOnePlaceDoNotMergeThem) {
  // Two rooms, 20 m apart, each seen twice by each session.
  std::vector<Place> places;
  for (const double room : {0.0, 20.0})
    for (const double step : {0.0, 0.4})
      places.push_back({planar(room + step, 0, 10 * step), planar(room, 0, 0), false});
  const Scans first(places), second(places);
  const Context context = Context::cpu(1);
  for (const double overlap : {0.5, 1.0}) {
    loop_closure::Options options = quick_options();
    options.acceptance.same_place_overlap = overlap;
    LoopCloser closer = closer_of(options);
    for (int k = 0; k < 4; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const Pose step =
          k > 0 ? first.s.odometry[at - 1].inverse() * first.s.odometry[at] : Pose::Identity();
      for (const FragmentId session : {0, 100}) {
        const Scans& scans = session == 0 ? first : second;
        closer.add({session + k, session, double(k), scans.cloud(context, k), scans.s.odometry[at],
                    std::nullopt});
        if (k > 0) closer.add_odometry(session + k, session + k - 1, step);
      }
    }
    const auto add = [&](int k) {
      closer.add_result(100 + k, k, between(second.s, k, first.s, k, 0.97));
      closer.process(0);  // no registrations
    };
    add(0);
    add(1);
    EXPECT_EQ(frames(closer), overlap < 1 ? 2u : 1u);
    if (overlap < 1) EXPECT_EQ(loop_of(closer.loops(), 101, 1).reason, LoopReason::unconfirmed);
    add(2);
    EXPECT_EQ(frames(closer), 1u);
    for (const int k : {0, 1, 2})
      EXPECT_EQ(loop_of(closer.loops(), 100 + k, k).state, LoopState::accepted) << k;
  }
}

TEST(Sessions, LoopsOfLittleConfidenceKeepConfirmingTheMerge) {
  LoopCloser closer = closer_of();
  const auto [first, second] = exact_sessions();
  first.add_to(closer);
  second.add_to(closer);
  // Two confident loops decide only with the others, which are not accepted themselves.
  for (int k = 3; k < 10; ++k)
    closer.add_result(100 + k, k + 7,
                      between(second, k, first, k + 7, k == 4 || k == 8 ? 0.97 : 0.3));
  // Three places that look as if they were five metres farther on.
  const Pose aside = planar(5, 0, 90);
  for (const int k : {0, 1, 2}) {
    const Pose seems = aside * second.truth[static_cast<std::size_t>(k)];
    closer.add_result(100 + k, k, correct(seems, first.truth[static_cast<std::size_t>(k)], 0.5));
  }
  closer.process();
  EXPECT_EQ(frames(closer), 1u);
  EXPECT_EQ(loop_of(closer.loops(), 104, 11).state, LoopState::accepted);
  EXPECT_EQ(loop_of(closer.loops(), 108, 15).state, LoopState::accepted);
  EXPECT_EQ(loop_of(closer.loops(), 106, 13).state, LoopState::candidate);
  EXPECT_NE(loop_of(closer.loops(), 101, 1).state, LoopState::accepted);
}

}  // namespace
}  // namespace gpureg::test
