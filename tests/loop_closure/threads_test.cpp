// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "loop_closure/drive.hpp"
#include "support/scan.hpp"

namespace gpureg::test {
namespace {

TEST(LoopCloserThreads, EverythingMayBeCalledBesideProcess) {
  LoopCloser closer = closer_of();
  const Sequence s = sequence(square(120));
  std::atomic<bool> done{false};
  std::thread host([&] {
    for (int k = 0; k < 120; ++k) {
      s.add_to(closer, k, k + 1);
      if (k >= 20 && k % 4 == 0) add_correct(closer, s, k, k - 20, 0.9);
      if (k % 10 == 9) closer.set_covisible(k, {k - 2, k - 3});
      if (k % 30 == 29) closer.set_poses({{k, s.odometry[static_cast<std::size_t>(k)]}});
      if (k >= 80) closer.remove(k - 80);
      closer.poses();
      closer.loops();
    }
    done = true;
  });
  while (!done) {
    closer.process(5.0);
    closer.graph();
  }
  host.join();
  closer.process();
  EXPECT_EQ(closer.size(), 80u);
  EXPECT_EQ(closer.poses().size(), 80u);
  std::size_t accepted = 0;
  for (const Loop& loop : closer.loops()) accepted += loop.state == LoopState::accepted;
  EXPECT_GT(accepted, 10u);
}

TEST(LoopCloserThreads, OtherCallsDoNotWaitForARegistration) {
  const Context context = Context::cpu(1);
  std::mt19937 random(5);
  const std::vector<Eigen::Vector3f> points = scan_room(random);
  const PreparedCloud cloud = prepare(context, PointCloudView(points));
  LoopCloser closer(context);
  for (int k = 0; k < 3; ++k) closer.add({k, 0, 0, cloud});
  for (int k = 1; k < 3; ++k) closer.add_odometry(k, k - 1, planar(1, 0, 0));
  closer.propose(2, 0);
  closer.propose(1, 0);
  std::atomic<bool> inside{false}, left{false};
  loop_closure::ProcessLimits limits;
  limits.should_stop = [&] {
    inside = true;
    return false;
  };
  std::thread worker([&] {
    closer.process(limits);
    left = true;
  });
  while (!inside) std::this_thread::yield();
  // The registrations take far longer than hundreds of calls, unless one of these waits for them.
  for (int k = 3; k < 103; ++k) {
    closer.add({k, 0, 0});
    closer.graph();
    closer.poses();
    closer.loops();
  }
  EXPECT_FALSE(left);
  EXPECT_EQ(closer.size(), 103u);
  worker.join();
  closer.process();
  EXPECT_EQ(closer.poses().size(), 103u);
}

}  // namespace
}  // namespace gpureg::test
