// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>

#include "loop_closure/scans.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::test {
namespace {

const Scans& scans() {
  static const Scans all = scans_of_one_room(5);
  return all;
}

TEST(Registrations, WhatOverlapsIsProposedRegisteredAndAccepted) {
  const Context context = Context::cpu(2);
  LoopCloser closer(context, quick_options());
  scans().add_to(closer, context, 0, 5);
  closer.set_covisible(4, {2});
  const Update update = closer.process();
  // 2-0, 3-0, 3-1, 4-0, 4-1; neighbours are connected by odometry, 4-2 by tracking.
  EXPECT_EQ(update.registered, 5u);
  EXPECT_EQ(update.proposals_left, 0u);
  ASSERT_EQ(update.changed.size(), 5u);
  for (const Loop& loop : update.changed) {
    EXPECT_EQ(loop.state, LoopState::accepted) << loop.source << " " << loop.target;
    EXPECT_GT(loop.confidence, 0.5);
    EXPECT_FALSE(loop.from_host);
  }
  EXPECT_FALSE(has_loop(update.changed, 4, 2));
  // Registrations are good to a centimetre here, odometry was not.
  EXPECT_LT(largest_error(update.poses, scans().s), 0.03);
  EXPECT_EQ(closer.process().registered, 0u);
}

TEST(Registrations, TheHostsProposalsComeFirstAndLimitsHold) {
  const Context context = Context::cpu(2);
  LoopCloser closer(context, quick_options());
  scans().add_to(closer, context, 0, 5);
  closer.propose(4, 3);
  loop_closure::ProcessLimits limits;
  limits.registrations = 1;
  Update update = closer.process(limits);
  EXPECT_EQ(update.registered, 1u);
  EXPECT_EQ(update.proposals_left, 6u);
  ASSERT_EQ(update.changed.size(), 1u);
  EXPECT_EQ(update.changed[0].source, 4);
  EXPECT_EQ(update.changed[0].target, 3);
  EXPECT_EQ(closer.process(0.0).registered, 0u);
  // A limit of a millisecond ends after the first chunk, of one pair here.
  EXPECT_EQ(closer.process(1.0).registered, 1u);
  limits.registrations = 100;
  update = closer.process(limits);
  EXPECT_EQ(update.registered + 2, 7u);
}

TEST(Registrations, TheBitsDependNeitherOnThreadsNorOnSaving) {
  TemporaryFolder folder;
  const Context one = Context::cpu(1), two = Context::cpu(2);
  loop_closure::Options options = quick_options();
  options.chunk = 2;
  LoopCloser a(one, options), b(two, options), c(two, options);
  loop_closure::ProcessLimits half;
  half.registrations = 2;
  const auto drive = [&](LoopCloser& closer, const Context& context, LoopCloser* load) {
    scans().add_to(closer, context, 0, 4);
    closer.process(half);
    LoopCloser* now = &closer;
    if (load) {
      closer.save(folder / "state");
      load->load(folder / "state",
                 [&](FragmentId id) { return scans().cloud(context, static_cast<int>(id)); });
      now = load;
    }
    scans().add_to(*now, context, 4, 5);
    now->process();
  };
  drive(a, one, nullptr);
  LoopCloser before(two, options);
  drive(before, two, &b);
  drive(c, two, nullptr);
  EXPECT_FALSE(a.loops().empty());
  EXPECT_EQ(bytes_of(a), bytes_of(c)) << "threads";
  EXPECT_EQ(bytes_of(b), bytes_of(c)) << "saving";
}

TEST(Registrations, WithoutOdometryPairsAreProposedAndConfirmEachOther) {
  const Context context = Context::cpu(2);
  loop_closure::Options options = quick_options();
  options.acceptance.same_place_overlap = 1;  // all of them see one room
  LoopCloser closer(context, options);
  const Scans& all = scans();
  // Two sessions of two fragments that odometry connects, far from each other in the host's frames.
  for (int k = 0; k < 4; ++k) {
    const Pose frame = k < 2 ? Pose(Pose::Identity()) : planar(100, 50, 77);
    const auto at = static_cast<std::size_t>(k);
    closer.add({k, k / 2, 0, all.cloud(context, k), frame * all.s.odometry[at]});
    if (k % 2 == 1)
      closer.add_odometry(k, k - 1, all.s.odometry[at - 1].inverse() * all.s.odometry[at]);
  }
  const Update update = closer.process();
  EXPECT_GE(update.registered, 2u);
  for (const loop_closure::FragmentPose& pose : update.poses) EXPECT_EQ(pose.frame, 0);
  EXPECT_LT(largest_error(closer.poses(),
                          Sequence{{all.s.truth.begin(), all.s.truth.begin() + 4}, {}, 0, 0}),
            0.05);
}

}  // namespace
}  // namespace gpureg::test
