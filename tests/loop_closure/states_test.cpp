// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <map>
#include <stdexcept>
#include <utility>

#include "loop_closure/drive.hpp"
#include "support/expect_error.hpp"

namespace gpureg::test {
namespace {

TEST(LoopStates, AConfidentLoopWithinTheDriftIsAcceptedAndMovesTheMap) {
  LoopCloser closer = closer_of();
  const Sequence s = sequence(square(20));
  s.add_to(closer);
  const Update before = closer.process();
  ASSERT_EQ(before.poses.size(), 20u);
  EXPECT_TRUE(before.changed.empty());
  EXPECT_GT(relative_error(before.poses, s, 19, 0), 0.2);
  add_correct(closer, s, 19, 0, 0.95);
  add_correct(closer, s, 18, 0, 0.95);
  const Update after = closer.process();
  ASSERT_EQ(after.changed.size(), 2u);
  for (const Loop& loop : after.changed) {
    EXPECT_EQ(loop.state, LoopState::accepted);
    EXPECT_EQ(loop.reason, LoopReason::confident);
    EXPECT_EQ(loop.weight, 1);
    EXPECT_LE(loop.drift_ratio, 1);
    EXPECT_GT(loop.information(5, 5), 0);
  }
  // The results are 4 mm off; odometry pulls a little.
  EXPECT_LT(relative_error(after.poses, s, 19, 0), 0.02);
  EXPECT_TRUE(closer.process().changed.empty());
}

TEST(LoopStates, ALoopOfLittleConfidenceWaitsForAnIndependentOne) {
  LoopCloser closer = closer_of();
  const Sequence s = sequence(square(40));
  s.add_to(closer);
  closer.process();
  const double drift = relative_error(closer.poses(), s, 30, 10);
  add_correct(closer, s, 30, 10, 0.7);
  Update update = closer.process();
  ASSERT_EQ(update.changed.size(), 1u);
  EXPECT_EQ(update.changed[0].state, LoopState::candidate);
  EXPECT_EQ(update.changed[0].reason, LoopReason::unconfirmed);
  // The graph without loops is solved again: rounding.
  EXPECT_NEAR(relative_error(closer.poses(), s, 30, 10), drift, 1e-9);
  // One that shares a fragment with it is no confirmation.
  add_correct(closer, s, 30, 11, 0.7);
  update = closer.process();
  EXPECT_EQ(update.changed.size(), 1u);
  EXPECT_EQ(loop_of(closer.loops(), 30, 10).state, LoopState::candidate);
  add_correct(closer, s, 32, 12, 0.7);
  update = closer.process();
  EXPECT_EQ(update.changed.size(), 3u);
  for (const Loop& loop : update.changed) {
    EXPECT_EQ(loop.state, LoopState::accepted);
    EXPECT_EQ(loop.reason, LoopReason::confirmed);
  }
  EXPECT_LT(relative_error(closer.poses(), s, 30, 10), 0.1 * drift);
}

TEST(LoopStates, WhatContradictsIsRejectedWithReason) {
  LoopCloser closer = closer_of();
  const Sequence s = sequence(square(40));
  s.add_to(closer);
  for (int k = 20; k < 40; k += 2) add_correct(closer, s, k, k - 20, 0.8);
  // Within the drift of odometry, but not where the others say: half a metre aside.
  closer.add_result(31, 11,
                    result_of(s.truth[11].inverse() * s.truth[31] * planar(0, 0.5, 5), 0.8));
  closer.add_result(33, 13, {});
  closer.process();
  EXPECT_EQ(loop_of(closer.loops(), 30, 10).state, LoopState::accepted);
  EXPECT_EQ(loop_of(closer.loops(), 31, 11).state, LoopState::rejected);
  EXPECT_EQ(loop_of(closer.loops(), 31, 11).reason, LoopReason::inconsistent);
  EXPECT_EQ(loop_of(closer.loops(), 33, 13).state, LoopState::rejected);
  EXPECT_EQ(loop_of(closer.loops(), 33, 13).reason, LoopReason::not_aligned);
}

TEST(LoopStates, ANearMissWithinItsStatedNoiseIsRejectedByTheResidualsOfTheOthers) {
  const Sequence s = sequence(square(40));
  const Pose near_miss = s.truth[11].inverse() * s.truth[31] * planar(0, 0.15, 2.5);
  // Alone with one other, within the noise of both, it is accepted.
  LoopCloser few = closer_of();
  s.add_to(few);
  add_correct(few, s, 30, 10, 0.95);
  few.add_result(31, 11, result_of(near_miss, 0.95));
  few.process();
  EXPECT_EQ(loop_of(few.loops(), 31, 11).state, LoopState::accepted);
  // Ten that agree within millimetres say that it is wrong.
  LoopCloser many = closer_of();
  s.add_to(many);
  for (int k = 20; k < 40; k += 2) add_correct(many, s, k, k - 20, 0.95);
  many.add_result(31, 11, result_of(near_miss, 0.95));
  many.process();
  EXPECT_EQ(loop_of(many.loops(), 31, 11).state, LoopState::rejected);
  EXPECT_EQ(loop_of(many.loops(), 31, 11).reason, LoopReason::inconsistent);
  for (int k = 20; k < 40; k += 2)
    EXPECT_EQ(loop_of(many.loops(), k, k - 20).state, LoopState::accepted) << k;
}

TEST(LoopStates, CovariancesOfTheHostAreNotScaled) {
  Sequence s = sequence(square(40, 5, 7.5));
  s.odometry = drifted(s.truth, 0.9, 1.02);  // as where modelled odometry accepts them
  LoopCloser closer = closer_of();
  UnalignedMatrix6d covariance = UnalignedMatrix6d::Identity() * 1e-8;
  for (int k = 0; k < 40; ++k) {
    const auto at = static_cast<std::size_t>(k);
    closer.add({k, 0, double(k), {}, s.odometry[at]});
    if (k > 0)
      closer.add_odometry(k, k - 1, s.odometry[at - 1].inverse() * s.odometry[at], covariance);
  }
  for (int k = 20; k < 40; k += 2) add_correct(closer, s, k, k - 20, 0.8);
  closer.process();
  for (const Loop& loop : closer.loops()) {
    EXPECT_EQ(loop.state, LoopState::candidate);
    EXPECT_EQ(loop.reason, LoopReason::exceeds_drift);
  }
}

TEST(LoopStates, OfSeveralModesTheOneThatFitsTakesPart) {
  LoopCloser closer = closer_of();
  const Sequence s = sequence(square(40));
  s.add_to(closer);
  for (int k = 20; k < 40; k += 4) add_correct(closer, s, k, k - 20, 0.9);
  RegistrationResult two = result_of(s.truth[2].inverse() * s.truth[22] * planar(2, 0, 90), 0.53);
  two.modes.push_back(correct(s.truth[22], s.truth[2], 0.52).modes[0]);
  closer.add_result(22, 2, two);
  closer.process();
  const Loop loop = loop_of(closer.loops(), 22, 2);
  EXPECT_EQ(loop.state, LoopState::accepted);
  EXPECT_EQ(loop.confidence, 0.52);
  EXPECT_LT((loop.target_from_source.matrix() - two.modes[1].target_from_source.matrix()).norm(),
            1e-12);
}

/// The factors of a host that does what the states say and nothing else.
class Factors {
 public:
  void take(const Update& update) {
    for (const Loop& loop : update.changed) {
      Pose& factor = factors_[{loop.source, loop.target}];
      const bool had = std::exchange(held_[{loop.source, loop.target}], false);
      if (loop.state == LoopState::retracted) {
        EXPECT_TRUE(had);
        EXPECT_EQ(factor.matrix(), loop.target_from_source.matrix());
      } else {
        EXPECT_FALSE(had) << loop.source << " " << loop.target << " is added twice";
      }
      held_[{loop.source, loop.target}] = loop.state == LoopState::accepted;
      factor = loop.target_from_source;
    }
  }

  /// They are those of the closer.
  void expect_equal(const LoopCloser& closer) const {
    std::size_t held = 0;
    for (const auto& [pair, is_held] : held_) held += is_held;
    std::size_t accepted = 0;
    for (const Loop& loop : closer.loops()) {
      if (loop.state != LoopState::accepted) continue;
      ++accepted;
      ASSERT_TRUE(held_.at({loop.source, loop.target}));
      EXPECT_EQ(factors_.at({loop.source, loop.target}).matrix(), loop.target_from_source.matrix());
    }
    EXPECT_EQ(held, accepted);
  }

 private:
  std::map<std::pair<FragmentId, FragmentId>, bool> held_;
  std::map<std::pair<FragmentId, FragmentId>, Pose> factors_;
};

TEST(LoopStates, AnAcceptedLoopWhosePoseChangesIsRetractedAndAcceptedAgain) {
  const Sequence s = sequence(square(40));
  // The first mode fits odometry; the loops that come later say that the second one is correct.
  RegistrationResult two = result_of(s.odometry[2].inverse() * s.odometry[22], 0.92);
  two.modes.push_back(correct(s.truth[22], s.truth[2], 0.92).modes[0]);
  LoopCloser closer = closer_of(), twin = closer_of();
  Factors host;
  Update update;
  for (LoopCloser* c : {&twin, &closer}) {
    s.add_to(*c);
    c->add_result(22, 2, two);
    c->add_result(33, 13, {});
    update = c->process();
  }
  host.take(update);
  ASSERT_EQ(loop_of(update.changed, 22, 2).state, LoopState::accepted);
  // The pair without a pose is rejected once.
  EXPECT_EQ(update.changed.size(), 2u);
  EXPECT_TRUE(closer.process().changed.empty());
  for (LoopCloser* c : {&twin, &closer})
    for (int k = 20; k < 40; k += 2)
      if (k != 22) add_correct(*c, s, k, k - 20, 0.95);
  // What the first call of the two decides is not delivered: its last poll throws.
  int polls = 0;
  loop_closure::ProcessLimits limits;
  limits.should_stop = [&] { return ++polls < 0; };
  twin.process(limits);
  limits.should_stop = [&]() -> bool {
    if (--polls == 0) throw std::runtime_error("interrupted");
    return false;
  };
  EXPECT_THROW(closer.process(limits), std::runtime_error);
  add_correct(closer, s, 39, 19, 0.95);
  update = closer.process();
  host.take(update);
  host.expect_equal(closer);
  std::vector<Loop> moved;
  for (const Loop& loop : update.changed)
    if (loop.source == 22) moved.push_back(loop);
  ASSERT_EQ(moved.size(), 2u);
  EXPECT_EQ(moved[0].state, LoopState::retracted);
  EXPECT_EQ(moved[0].reason, LoopReason::replaced);
  EXPECT_EQ(moved[0].target_from_source.matrix(), two.modes[0].target_from_source.matrix());
  EXPECT_EQ(moved[1].state, LoopState::accepted);
  EXPECT_EQ(moved[1].target_from_source.matrix(), two.modes[1].target_from_source.matrix());
}

TEST(LoopStates, WhatAThrowingHookEndsBelongsToTheNextCall) {
  const Sequence s = sequence(square(40));
  const auto fill = [&](LoopCloser& closer) {
    s.add_to(closer);
    for (int k = 20; k < 40; k += 3) add_correct(closer, s, k, k - 20, 0.8);
  };
  LoopCloser other = closer_of();
  fill(other);
  const Update whole = other.process();
  // Thrown by the first poll, the second, ... until a call is through.
  for (int polls = 0;; ++polls) {
    LoopCloser closer = closer_of();
    fill(closer);
    loop_closure::ProcessLimits limits;
    limits.should_stop = [left = polls]() mutable -> bool {
      if (left-- == 0) throw std::runtime_error("interrupted");
      return false;
    };
    bool threw = false;
    Update update;
    try {
      update = closer.process(limits);
    } catch (const std::runtime_error&) {
      threw = true;
      update = closer.process();
    }
    ASSERT_EQ(update.changed.size(), whole.changed.size()) << polls;
    EXPECT_EQ(update.poses.size(), whole.poses.size());
    for (std::size_t k = 0; k < whole.changed.size(); ++k)
      EXPECT_EQ(update.changed[k].state, whole.changed[k].state);
    EXPECT_EQ(bytes_of(closer), bytes_of(other));
    EXPECT_TRUE(closer.process().changed.empty());
    if (!threw) {
      EXPECT_GT(polls, 3);  // before, while and after the graph is optimised
      break;
    }
  }
}

TEST(LoopStates, LoopsOfTheHostAreVerifiedLikeOthers) {
  LoopCloser closer = closer_of();
  const Sequence s = sequence(square(40));
  s.add_to(closer);
  closer.add_loop(30, 10, s.truth[10].inverse() * s.truth[30], std::nullopt, 0.95);
  closer.add_loop(35, 2, s.truth[10].inverse() * s.truth[30], std::nullopt, 0.95);
  closer.process();
  const Loop good = loop_of(closer.loops(), 30, 10), wrong = loop_of(closer.loops(), 35, 2);
  EXPECT_TRUE(good.from_host);
  EXPECT_EQ(good.state, LoopState::accepted);
  EXPECT_NE(wrong.state, LoopState::accepted);
}

TEST(LoopStates, AHostWithABackEndOfItsOwnGetsTheSameStatesAndNoPoses) {
  loop_closure::Options options;
  LoopCloser own = closer_of(options);
  options.optimize = false;
  LoopCloser theirs = closer_of(options);
  const Sequence s = sequence(square(40));
  for (LoopCloser* closer : {&own, &theirs}) {
    s.add_to(*closer);
    for (int k = 20; k < 40; k += 3) add_correct(*closer, s, k, k - 20, 0.8);
  }
  own.process();
  const Update update = theirs.process();
  EXPECT_TRUE(update.poses.empty());
  ASSERT_EQ(own.loops().size(), theirs.loops().size());
  for (std::size_t k = 0; k < own.loops().size(); ++k)
    EXPECT_EQ(own.loops()[k].state, theirs.loops()[k].state);
  // Its poses come back.
  theirs.set_poses(own.poses());
  theirs.process();
  EXPECT_EQ(largest_error(own.poses(), s), largest_error(theirs.poses(), s));
  EXPECT_EQ(theirs.graph().edges.size(), own.graph().edges.size());
}

TEST(LoopStates, TheFactorIsThatOfThePoseGraph) {
  LoopCloser closer = closer_of();
  const Sequence s = sequence(square(20));
  s.add_to(closer);
  add_correct(closer, s, 19, 0, 0.95);
  closer.process();
  const Loop loop = loop_of(closer.loops(), 19, 0);
  const pose_graph::Graph graph = closer.graph();
  const pose_graph::Edge& edge = graph.edges.back();
  EXPECT_EQ(edge.source, loop.source);
  EXPECT_EQ(edge.target, loop.target);
  EXPECT_EQ(edge.target_from_source.matrix(), loop.target_from_source.matrix());
  EXPECT_EQ(*edge.information, loop.information);
  graph.validate();
}

TEST(LoopStates, LengthsOfLoopsmartFollowTheVoxelSize) {
  const loop_closure::Options paper = loop_closure::Options::loopsmart(0.2f),
                              ours = loop_closure::Options{RegistrationOptions{0.2f}};
  EXPECT_EQ(paper.registration.voxel_size, 0.2f);
  EXPECT_EQ(paper.proposals.coarse_voxel_size, ours.proposals.coarse_voxel_size);
  EXPECT_EQ(paper.noise.translation, ours.noise.translation);
  EXPECT_EQ(paper.host_noise.translation, ours.host_noise.translation);
  EXPECT_EQ(paper.graph.line_process.odometry_weight, 1000);
}

TEST(LoopStates, LoopsmartAcceptsByTheLineProcessAlone) {
  loop_closure::Options options = loop_closure::Options::loopsmart();
  EXPECT_EQ(options.graph.robust, pose_graph::Robust::line_process);
  EXPECT_EQ(options.graph.line_process.odometry_weight, 1000);
  LoopCloser closer = closer_of(options);
  Sequence s = sequence(square(20));
  s.odometry = s.truth;
  s.add_to(closer);
  add_correct(closer, s, 19, 0, 0.6);
  closer.add_result(18, 2, result_of(planar(0, 0, 0), 0.95));
  closer.process();
  EXPECT_EQ(loop_of(closer.loops(), 19, 0).reason, LoopReason::by_graph);
  EXPECT_EQ(loop_of(closer.loops(), 18, 2).state, LoopState::rejected);
}

}  // namespace
}  // namespace gpureg::test
