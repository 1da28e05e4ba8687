// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/common/exec.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <random>
#include <stdexcept>
#include <thread>

#include "common/radix_sort.hpp"
#include "common/stop_scope.hpp"

namespace gpureg::cpu {
namespace {

TEST(Exec, RunsEveryTaskOnce) {
  for (const unsigned threads : {1u, 2u, 7u}) {
    Exec exec(threads);
    EXPECT_EQ(exec.threads(), threads);
    for (const std::size_t count :
         {std::size_t(0), std::size_t(1), std::size_t(5), std::size_t(1000)}) {
      std::vector<std::atomic<int>> hits(count);
      exec.parallel(count, [&](std::size_t k) { ++hits[k]; });
      for (const auto& h : hits) EXPECT_EQ(h, 1);
    }
  }
}

TEST(Exec, BlocksCoverEveryItemOfEveryEntry) {
  Exec exec(3);
  const std::vector<std::size_t> counts = {0, 1, 99, 100, 101, 0, 250};
  std::vector<std::vector<std::atomic<int>>> hits;
  for (const std::size_t n : counts) hits.emplace_back(n);
  exec.parallel_items(
      counts.size(), [&](std::size_t e) { return counts[e]; }, 100,
      [&](std::size_t e, std::size_t begin, std::size_t end) {
        EXPECT_LE(end - begin, 100u);
        for (std::size_t k = begin; k < end; ++k) ++hits[e][k];
      });
  for (const auto& entry : hits)
    for (const auto& h : entry) EXPECT_EQ(h, 1);
}

TEST(Exec, RethrowsAndStaysUsable) {
  Exec exec(4);
  EXPECT_THROW(exec.parallel(100,
                             [](std::size_t k) {
                               if (k == 17) throw std::runtime_error("17");
                             }),
               std::runtime_error);
  std::atomic<int> sum{0};
  exec.parallel(100, [&](std::size_t) { ++sum; });
  EXPECT_EQ(sum, 100);
}

TEST(Exec, StopsWhereTheCallerSaysSo) {
  for (const unsigned threads : {1u, 4u}) {
    Exec exec(threads);
    const auto wait = [](std::size_t) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    };
    int asked = 0;
    {
      const StopScope scope([&] {
        EXPECT_TRUE(StopScope::asking());
        return ++asked == 2;
      });
      // Ten seconds of work at four threads: ends long before.
      EXPECT_THROW(exec.parallel(40000, wait), Stopped);
      EXPECT_FALSE(StopScope::asking());
    }
    EXPECT_EQ(asked, 2);
    exec.parallel(200, wait);  // nobody asks any more
    EXPECT_EQ(asked, 2);
  }
}

TEST(RadixSort, IsStableAndSorts) {
  std::mt19937_64 random(2);
  for (const std::size_t n : {std::size_t(0), std::size_t(1), std::size_t(2), std::size_t(10000)}) {
    std::vector<KeyIndex> items(n);
    // Few distinct keys in the low and the high bits: ties, and digits that never vary.
    for (std::size_t k = 0; k < n; ++k)
      items[k] = {(random() % 50) << 40 | random() % 7, static_cast<std::uint32_t>(k)};
    std::vector<KeyIndex> expected = items;
    std::stable_sort(expected.begin(), expected.end(),
                     [](const KeyIndex& a, const KeyIndex& b) { return a.key < b.key; });
    radix_sort(items);
    for (std::size_t k = 0; k < n; ++k) {
      EXPECT_EQ(items[k].key, expected[k].key);
      EXPECT_EQ(items[k].index, expected[k].index);
    }
  }
}

}  // namespace
}  // namespace gpureg::cpu
