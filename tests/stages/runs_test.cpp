// SPDX-License-Identifier: BSD-3-Clause
// Cuts of batches by memory and among devices.
#include "pipeline/runs.hpp"

#include <gtest/gtest.h>

#include <random>

namespace gpureg::pipeline {
namespace {

std::vector<std::pair<std::size_t, std::size_t>> ends(const std::vector<Run>& runs) {
  std::vector<std::pair<std::size_t, std::size_t>> out;
  for (const Run& run : runs) out.emplace_back(run.begin, run.end);
  return out;
}

TEST(RunsWithin, FillsTheLimitInOrder) {
  using Ends = std::vector<std::pair<std::size_t, std::size_t>>;
  const std::vector<std::uint64_t> weight{3, 4, 3, 0, 11, 0, 10, 1};
  const auto of = [&](std::size_t k) { return weight[k]; };
  EXPECT_EQ(ends(runs_within(weight.size(), 10, of)), (Ends{{0, 4}, {4, 5}, {5, 7}, {7, 8}}));
  EXPECT_EQ(ends(runs_within(weight.size(), 1000, of)), (Ends{{0, 8}}));
  EXPECT_EQ(ends(runs_within(weight.size(), 0, of)),
            (Ends{{0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}, {5, 6}, {6, 7}, {7, 8}}));
  EXPECT_TRUE(runs_within(0, 10, of).empty());
}

// 512 pairs of 2^22 survivors: 2^31 of them in all.
TEST(RunsWithin, CountsBeyond32Bits) {
  const auto runs =
      runs_within(4096, std::uint64_t(1) << 33, [](std::size_t) { return std::uint64_t(1) << 22; });
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[0].size(), 2048u);
}

TEST(SharedRuns, CoverEverythingWithinTheLimitOfMemory) {
  std::mt19937 random(3);
  for (int round = 0; round < 500; ++round) {
    const std::size_t items = random() % 3000, least = random() % 50, most = random() % 60,
                      takers = 1 + random() % 8;
    SharedRuns runs(items, least, most, takers);
    std::size_t next = 0;
    for (auto run = runs.take(); run.size() > 0; run = runs.take()) {
      ASSERT_EQ(run.begin, next);
      ASSERT_LE(run.size(), std::max<std::size_t>(1, most)) << "more than the memory holds";
      if (run.end < items) ASSERT_GE(run.size(), std::max<std::size_t>(1, std::min(least, most)));
      next = run.end;
    }
    EXPECT_EQ(next, items);
    EXPECT_EQ(runs.take().size(), 0u);
  }
}

TEST(SharedRuns, StopLeavesNothing) {
  SharedRuns runs(100, 4, 32, 2);
  EXPECT_GT(runs.take().size(), 0u);
  runs.stop();
  EXPECT_EQ(runs.take().size(), 0u);
}

// Clouds that keep so much of their points: the prepared bytes of a chunk stay within the budget.
TEST(RawPointBudget, HoldsForAnyDownsampling) {
  constexpr std::size_t kBudget = std::size_t(256) << 20, kCloud = 5000, kPoint = 1500;
  for (const std::size_t prepared_of_ten : {1u, 3u, 10u}) {
    RawPointBudget budget(kBudget, std::size_t(1) << 22);
    std::size_t largest = 0, chunks = 0;
    for (std::size_t left = 2000; left > 0; ++chunks) {
      const std::size_t clouds =
          std::min(left, std::max<std::size_t>(1, budget.most_points() / kCloud));
      const std::size_t bytes = clouds * kCloud * prepared_of_ten / 10 * kPoint;
      budget.measured(clouds * kCloud, bytes);
      largest = std::max(largest, bytes);
      left -= clouds;
    }
    EXPECT_LE(largest, kBudget) << prepared_of_ten;
    // Half the budget or more is used: two chunks instead of many small ones.
    EXPECT_LE(chunks, 3 + 2 * (2000 * kCloud * prepared_of_ten / 10 * kPoint) / kBudget);
  }
}

TEST(RawPointBudget, WithoutABudgetOnlyTheChunkLimits) {
  RawPointBudget budget(0, 12345);
  EXPECT_EQ(budget.most_points(), 12345u);
  budget.measured(10, 1 << 20);
  EXPECT_EQ(budget.most_points(), 12345u);
  // Less than one point's memory still means a cloud at a time.
  EXPECT_EQ(RawPointBudget(100, 12345).most_points(), 1u);
}

}  // namespace
}  // namespace gpureg::pipeline
