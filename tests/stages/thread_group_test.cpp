// SPDX-License-Identifier: BSD-3-Clause
#include "common/thread_group.hpp"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

namespace gpureg {
namespace {

TEST(ThreadGroup, CallsEachElementOfLoopsWithinALoopOnce) {
  for (const std::size_t size : {0, 1, 2, 5}) {
    ThreadGroup threads(size);
    for (const std::size_t count : {0, 1, 17}) {
      std::vector<std::vector<int>> calls(count, std::vector<int>(30, 0));
      threads.parallel(count, [&](std::size_t a) {
        threads.parallel(30, [&](std::size_t b) { ++calls[a][b]; });
      });
      for (const auto& of_one : calls)
        for (const int n : of_one) EXPECT_EQ(n, 1);
    }
  }
}

TEST(ThreadGroup, IdleThreadsHelpWithTheLoopWithinAnElement) {
  ThreadGroup threads(3);
  std::mutex mutex;
  std::condition_variable changed;
  std::set<std::thread::id> ids;
  threads.parallel(1, [&](std::size_t) {
    threads.parallel(3, [&](std::size_t) {
      // No thread ends its element before each has one.
      std::unique_lock<std::mutex> lock(mutex);
      ids.insert(std::this_thread::get_id());
      changed.notify_all();
      changed.wait(lock, [&] { return ids.size() == 3; });
    });
  });
  EXPECT_EQ(ids.size(), 3u);
}

TEST(ThreadGroup, RethrowsAndGoesOn) {
  ThreadGroup threads(3);
  const auto work = [&](std::size_t a) {
    threads.parallel(5, [&](std::size_t b) {
      if (a == 7 && b == 3) throw std::runtime_error("an element");
    });
  };
  EXPECT_THROW(threads.parallel(20, work), std::runtime_error);
  EXPECT_NO_THROW(threads.parallel(7, work));
}

TEST(ThreadGroup, TakesLoopsOfSeveralThreads) {
  ThreadGroup threads(3);
  std::vector<int> first(40, 0), second(40, 0);
  std::thread other([&] { threads.parallel(40, [&](std::size_t k) { ++first[k]; }); });
  threads.parallel(40, [&](std::size_t k) { ++second[k]; });
  other.join();
  EXPECT_EQ(first, std::vector<int>(40, 1));
  EXPECT_EQ(second, std::vector<int>(40, 1));
}

}  // namespace
}  // namespace gpureg
