// SPDX-License-Identifier: BSD-3-Clause
// A short run of a 2-D scanner.
#include <gtest/gtest.h>

#include "loop_closure/drive.hpp"
#include "support/floor_plan.hpp"

namespace gpureg::test {
namespace {

TEST(FlatScans, AreLoopsInTheirPlane) {
  const Context context = Context::cpu(2);
  const double where[][3] = {
      {-1.2, 0.8, 0.2}, {-1.5, 0.0, 0.8}, {-1.1, -0.7, 1.4}, {-0.2, -1.0, 2.2}, {-1.4, 0.4, 3.0}};
  std::vector<Pose> truth;
  for (const auto& [x, y, turn] : where) truth.push_back(Pose(pose_in_plan(x, y, turn).matrix()));
  const Sequence run = sequence(truth);
  loop_closure::Options options;
  options.registration = RegistrationOptions{0.05f};
  LoopCloser closer(context, options);
  for (int k = 0; k < 5; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const std::vector<Eigen::Vector3f> scan =
        FloorPlan2d().scan(Eigen::Isometry3d(truth[at].matrix()), static_cast<unsigned>(k + 1));
    closer.add({k, 0, double(k), prepare(context, PointCloudView(scan), options.registration),
                run.odometry[at], std::nullopt});
    if (k > 0) closer.add_odometry(k, k - 1, run.odometry[at - 1].inverse() * run.odometry[at]);
  }
  const Update update = closer.process();
  EXPECT_GE(update.registered, 3u);
  int accepted = 0;
  for (const Loop& loop : update.changed) {
    EXPECT_EQ(loop.state, LoopState::accepted)
        << loop.source << " " << loop.target << " " << to_string(loop.reason);
    ++accepted;
    EXPECT_EQ(loop.target_from_source(2, 3), 0);
    EXPECT_EQ(loop.target_from_source(2, 2), 1);
    const Pose expected = truth[static_cast<std::size_t>(loop.target)].inverse() *
                          truth[static_cast<std::size_t>(loop.source)];
    EXPECT_LT((loop.target_from_source.matrix() - expected.matrix()).cwiseAbs().maxCoeff(), 0.03);
  }
  EXPECT_EQ(accepted, 6);  // all pairs but those that odometry connects
  for (const auto& pose : closer.poses()) EXPECT_NEAR(pose.world_from_fragment(2, 3), 0, 1e-6);
}

}  // namespace
}  // namespace gpureg::test
