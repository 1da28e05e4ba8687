// SPDX-License-Identifier: BSD-3-Clause
// Threads that the system does not start: all work is done, and no running thread is left behind.
#include "common/host_threads.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <atomic>
#include <cstdio>
#include <stdexcept>
#include <system_error>

#include "cpu/common/exec.hpp"

namespace gpureg {
namespace {

/// Starts so many threads, then fails as std::thread does at a limit on processes.
struct Limited {
  int left;
  template <typename Task>
  std::thread operator()(const Task& task) {
    if (left-- == 0)
      throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again));
    return std::thread(task);
  }
};

TEST(OnThreads, DoesTheWorkOfThreadsThatDoNotStart) {
  for (const int started : {0, 1, 3, 7, 100}) {
    Limited limited{started};
    std::vector<std::atomic<int>> hits(8);
    on_threads(
        hits.size(), [&](std::size_t k) { ++hits[k]; },
        [&](const auto& task) { return limited(task); });
    for (const auto& h : hits) EXPECT_EQ(h, 1) << started << " threads started";
  }
}

TEST(OnThreads, RethrowsTheErrorOfTheFirstThreadThatFailed) {
  for (const int started : {1, 100}) {
    Limited limited{started};
    std::atomic<int> done{0};
    try {
      on_threads(
          6,
          [&](std::size_t k) {
            ++done;
            if (k >= 3) throw std::runtime_error(std::to_string(k));
          },
          [&](const auto& task) { return limited(task); });
      ADD_FAILURE() << "no error";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "3");
    }
    EXPECT_EQ(done, 6);
  }
}

/// Limits the memory of this process to what it has and so much more.
void limit_memory(std::size_t more) {
  unsigned long pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%lu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  const rlimit limit{pages * 4096 + more, pages * 4096 + more};
  setrlimit(RLIMIT_AS, &limit);
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

// The stacks of 500 threads do not fit 100 MB.
TEST(ExecDeathTest, TakesTheThreadsThatTheSystemStarts) {
  if (kSanitized) GTEST_SKIP() << "sanitizers reserve more memory than the limit of this test";
  EXPECT_EXIT(
      {
        limit_memory(std::size_t(100) << 20);
        cpu::Exec exec(500);
        std::atomic<int> sum{0};
        exec.parallel(1000, [&](std::size_t) { ++sum; });
        std::exit(sum == 1000 && exec.threads() < 500 ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace gpureg
