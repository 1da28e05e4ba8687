// SPDX-License-Identifier: BSD-3-Clause
// Memory that runs out at any moment. A program of its own: it replaces operator new.
#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <limits>
#include <new>

#include "loop_closure/drive.hpp"
#include "loop_closure/scans.hpp"
#include "support/temporary_folder.hpp"

namespace {

/// Allocations of this thread until one fails; 0: none does.
thread_local std::size_t until_failure = 0;

}  // namespace

void* operator new(std::size_t size) {
  if (until_failure > 0 && --until_failure == 0) throw std::bad_alloc();
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
// Inlined, GCC would see free() on what it takes for memory of the library's operator new.
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace gpureg::test {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

/// false: the action failed with its n-th allocation. Allocations that are optional, the buffer of
/// a stable sort for one, may fail without anybody noticing.
bool succeeds(std::size_t n, const std::function<void()>& action) {
  until_failure = n;
  try {
    action();
  } catch (const std::bad_alloc&) {
    until_failure = 0;
    return false;
  }
  until_failure = 0;
  return true;
}

std::size_t allocations_of(const std::function<void()>& action) {
  until_failure = kNone;
  action();
  const std::size_t count = kNone - until_failure;
  until_failure = 0;
  return count;
}

std::string text_of(const Update& update) {
  std::string out;
  for (const Loop& loop : update.changed)
    out += std::to_string(loop.source) + "-" + std::to_string(loop.target) + " " +
           to_string(loop.state) + " " + to_string(loop.reason) + " " +
           std::to_string(loop.confidence) + "\n";
  for (const loop_closure::FragmentPose& pose : update.poses)
    out += std::to_string(pose.id) + " " +
           std::to_string(pose.world_from_fragment.translation().x()) + "\n";
  return out + pose_graph::to_string(update.status) + update.reason;
}

/// A closer with a history, whose next process() has everything to do.
class Allocations : public testing::Test {
 protected:
  Allocations() : path(folder / "base"), other(folder / "other") {
    options.graph.threads = 1;
    LoopCloser closer = closer_of(options);
    s.add_to(closer, 0, 24);
    for (int k = 20; k < 24; ++k) add_correct(closer, s, k, k - 20, 0.8);
    closer.process();
    closer.save(path);
  }

  LoopCloser loaded() const {
    LoopCloser closer = closer_of(options);
    closer.load(path, nullptr);
    return closer;
  }

  /// Calls of every kind, each by its number.
  void call(LoopCloser& closer, int number) const {
    switch (number) {
      case 0:
        return closer.add({24, 0, 24});
      case 1:
        return closer.add_odometry(24, 23, planar(1, 0, 0));
      case 2:
        return closer.set_covisible(24, {3, 4});
      case 3:
        return closer.add_loop(24, 4, s.truth[4].inverse() * s.truth[24]);
      case 4:
        return add_correct(closer, s, 22, 1, 0.9);
      case 5:
        return closer.add_result(21, 3, result_of(planar(3, 4, 80), 0.7));  // wrong
      case 6:
        return closer.set_poses({{5, s.truth[5]}, {6, s.truth[6]}});
      default:
        return closer.remove(12);
    }
  }
  static constexpr int kCalls = 8;

  std::string saved(const LoopCloser& closer) const {
    closer.save(other);
    return content_of(other) + bytes_of(closer);
  }

  TemporaryFolder folder;
  std::string path, other;
  loop_closure::Options options;
  Sequence s = sequence(square(25));
};

TEST_F(Allocations, ProcessGoesOnWhereItFailed) {
  LoopCloser good = loaded();
  for (int k = 0; k < kCalls; ++k) call(good, k);
  Update expected;
  const std::size_t count = allocations_of([&] { expected = good.process(); });
  const std::string state = saved(good), update = text_of(expected);
  EXPECT_GE(expected.changed.size(), 3u);
  std::size_t failed = 0;
  // Every allocation takes minutes under a sanitizer.
  const std::size_t stride = 1 + count / 300;
  for (std::size_t n = 1; n <= count; n += stride) {
    LoopCloser closer = loaded();
    for (int k = 0; k < kCalls; ++k) call(closer, k);
    const std::string before = bytes_of(closer);
    Update got;
    if (!succeeds(n, [&] { got = closer.process(); })) {
      ++failed;
      ASSERT_EQ(bytes_of(closer), before) << n;
      got = closer.process();
    }
    ASSERT_EQ(text_of(got), update) << n;
    ASSERT_EQ(saved(closer), state) << n;
  }
  EXPECT_GT(failed, 250u);
}

TEST_F(Allocations, ACallThatFailsChangesNothing) {
  LoopCloser good = loaded();
  for (int k = 0; k < kCalls; ++k) call(good, k);
  good.process();
  const std::string state = saved(good);
  for (std::size_t n = 1;; ++n) {
    LoopCloser closer = loaded();
    std::size_t failed = 0;
    for (int k = 0; k < kCalls; ++k) {
      const std::size_t size = closer.size();
      if (succeeds(n, [&] { call(closer, k); })) continue;
      ++failed;
      ASSERT_EQ(closer.size(), size) << "call " << k << " allocation " << n;
      call(closer, k);
    }
    closer.process();
    ASSERT_EQ(saved(closer), state) << n;
    if (failed == 0) break;
  }
}

TEST_F(Allocations, SavingAndLoadingFailWithoutATrace) {
  LoopCloser good = loaded();
  for (int k = 0; k < kCalls; ++k) call(good, k);
  const std::string state = saved(good);
  const std::size_t saving = allocations_of([&] { good.save(other); });
  for (std::size_t n = 1; n <= saving; n += 1 + saving / 100) {
    LoopCloser closer = loaded();
    for (int k = 0; k < kCalls; ++k) call(closer, k);
    succeeds(n, [&] { closer.save(other); });
    ASSERT_EQ(saved(closer), state) << n;
  }
  good.process();
  const std::string before = saved(good), after = saved(loaded());
  const std::size_t loading = allocations_of([&] { loaded(); });
  for (std::size_t n = 1; n <= loading; n += 1 + loading / 100) {
    LoopCloser closer = loaded();
    for (int k = 0; k < kCalls; ++k) call(closer, k);
    closer.process();
    const bool done = succeeds(n, [&] { closer.load(path, nullptr); });
    ASSERT_EQ(saved(closer), done ? after : before) << n;
  }
}

TEST(AllocationsOfRegistrations, ProcessGoesOnWhereItFailed) {
  const TemporaryFolder folder;
  const Context context = Context::cpu(1);
  const Scans scans = scans_of_one_room(3);
  loop_closure::Options options = quick_options();
  options.graph.threads = 1;
  std::vector<PreparedCloud> clouds;
  for (int k = 0; k < 3; ++k) clouds.push_back(scans.cloud(context, k));
  const auto fresh = [&] {
    LoopCloser closer(context, options);
    for (int k = 0; k < 3; ++k) {
      const auto at = static_cast<std::size_t>(k);
      closer.add({k, 0, double(k), clouds[at], scans.s.odometry[at]});
      if (k > 0)
        closer.add_odometry(k, k - 1, scans.s.odometry[at - 1].inverse() * scans.s.odometry[at]);
    }
    closer.propose(1, 0);
    return closer;
  };
  const auto saved = [&](const LoopCloser& closer) {
    closer.save(folder / "state");
    return content_of(folder / "state") + bytes_of(closer);
  };
  LoopCloser good = fresh();
  Update expected;
  const std::size_t count = allocations_of([&] { expected = good.process(); });
  EXPECT_EQ(expected.registered, 2u);
  const std::string state = saved(good), update = text_of(expected);
  for (std::size_t n = 1; n <= count; n += 1 + count / 20) {
    LoopCloser closer = fresh();
    Update got;
    if (!succeeds(n, [&] { got = closer.process(); })) got = closer.process();
    ASSERT_EQ(text_of(got), update) << n;
    ASSERT_EQ(saved(closer), state) << n;
  }
}

}  // namespace
}  // namespace gpureg::test
