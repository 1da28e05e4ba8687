// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "loop_closure/drive.hpp"
#include "support/expect_error.hpp"

namespace gpureg::test {
namespace {

/// Covariance of one node relative to the smallest one, which is held.
UnalignedMatrix6d marginal(const LoopCloser& closer, FragmentId node) {
  pose_graph::Options options;
  options.robust = pose_graph::Robust::none;
  options.marginals = {node};
  return pose_graph::optimize(closer.graph(), options).marginals.at(0).covariance;
}

UnalignedMatrix6d covariance(double rotation, double translation) {
  UnalignedMatrix6d out = UnalignedMatrix6d::Zero();
  out.diagonal().head<3>().setConstant(rotation * rotation);
  out.diagonal().tail<3>().setConstant(translation * translation);
  out(0, 4) = out(4, 0) = 0.3 * rotation * translation;
  return out;
}

TEST(Removal, InAChainTheMarginalOfTheRestIsTheSame) {
  LoopCloser closer = closer_of();
  const Sequence s = sequence(square(12));
  for (int k = 0; k < 12; ++k) {
    const auto at = static_cast<std::size_t>(k);
    closer.add({k, 0, 0, {}, s.odometry[at]});
    if (k > 0)
      closer.add_odometry(k, k - 1, s.odometry[at - 1].inverse() * s.odometry[at],
                          covariance(0.01 + 0.001 * k, 0.02 + 0.003 * k));
  }
  closer.process();
  const UnalignedMatrix6d full = marginal(closer, 11);
  for (const FragmentId id : {3, 4, 7, 10}) closer.remove(id);
  closer.process();
  EXPECT_EQ(closer.size(), 8u);
  EXPECT_EQ(closer.graph().edges.size(), 7u);
  // Composition along a chain is the marginal itself; the rest is rounding of inverses.
  EXPECT_LT((marginal(closer, 11) - full).norm(), 1e-7 * full.norm());
  const auto poses = closer.poses();
  EXPECT_LT((poses.back().world_from_fragment.matrix() - s.odometry[11].matrix()).norm(), 1e-9);
}

TEST(Removal, LoopsMoveToANeighbourAndAddNoCertainty) {
  LoopCloser closer = closer_of();
  const Sequence s = sequence(square(40));
  s.add_to(closer);
  for (int k = 20; k < 40; k += 4) add_correct(closer, s, k, k - 20, 0.95);
  closer.process();
  const UnalignedMatrix6d full = marginal(closer, 39), middle = marginal(closer, 15);
  const auto before = closer.poses();
  for (const FragmentId id : {4, 24, 28}) closer.remove(id);
  const Update update = closer.process();
  EXPECT_EQ(update.poses.size(), 37u);
  // As a host reports it, the loop is still that of 24 and 4.
  EXPECT_EQ(loop_of(closer.loops(), 24, 4).state, LoopState::accepted);
  std::size_t loops = 0;
  for (const pose_graph::Edge& edge : closer.graph().edges)
    loops += edge.kind == pose_graph::EdgeKind::loop;
  EXPECT_EQ(loops, 5u);
  // Nearly the covariance of the full graph. It may be larger: what the two edges of a removed node
  // say about a third one is counted once.
  for (const auto& [node, was] : {std::pair{39, full}, std::pair{15, middle}}) {
    const UnalignedMatrix6d now = marginal(closer, node);
    EXPECT_GT(now.trace(), 0.98 * was.trace()) << node;
    EXPECT_LT(now.trace(), 1.15 * was.trace()) << node;
  }
  for (const loop_closure::FragmentPose& pose : closer.poses())
    for (const loop_closure::FragmentPose& old : before)
      if (old.id == pose.id)
        EXPECT_LT(
            (old.world_from_fragment.translation() - pose.world_from_fragment.translation()).norm(),
            0.02);
  // A loop whose fragments are gone can still be retracted: it contradicts those that follow.
  EXPECT_GT(closer.graph().edges.size(), 0u);
}

TEST(Removal, FreesTheIdAndTheCloud) {
  LoopCloser closer = closer_of();
  std::vector<Eigen::Vector3f> points;
  for (int k = 0; k < 500; ++k)
    points.emplace_back(0.1f * float(k % 25), 0.1f * float(k / 25), 0.3f * float(k % 7));
  closer.add({1, 0, 0, prepare(Context::cpu(1), PointCloudView(points))});
  closer.add({2});
  closer.add_odometry(2, 1, planar(1, 0, 0));
  closer.process();
  closer.remove(1);
  expect_error<InvalidArgument>([&] { closer.remove(1); }, {"fragment 1"});
  closer.add({1});
  closer.add_odometry(1, 2, planar(1, 0, 0));
  closer.process();
  EXPECT_EQ(closer.size(), 2u);
  expect_error<InvalidArgument>([&] { closer.propose(1, 2); }, {"has no cloud"});
}

TEST(Removal, KeepsAWindowOfFragmentsAtOneSize) {
  LoopCloser closer = closer_of();
  constexpr int kWindow = 40, kFragments = 600;
  const std::vector<Pose> lap = square(20);
  const Sequence s = sequence(lap);
  std::size_t loops = 0, edges = 0;
  for (int k = 0; k < kFragments; ++k) {
    closer.add({k, 0, double(k)});
    const auto at = static_cast<std::size_t>(k % 20),
               last = static_cast<std::size_t>((k + 19) % 20);
    if (k > 0) closer.add_odometry(k, k - 1, lap[last].inverse() * lap[at]);
    if (k >= 20 && k % 5 == 0) closer.add_result(k, k - 20, correct(lap[at], lap[at], 0.95));
    if (k >= kWindow) closer.remove(k - kWindow);
    if (k % 20 == 0) closer.process();
    if (k == kFragments / 2) {
      loops = closer.loops().size();
      edges = closer.graph().edges.size();
    }
  }
  closer.process();
  EXPECT_EQ(closer.size(), std::size_t(kWindow));
  EXPECT_GT(loops, 2u);
  EXPECT_LE(closer.loops().size(), loops + 4);
  EXPECT_LE(closer.graph().edges.size(), edges + 4);
}

}  // namespace
}  // namespace gpureg::test
