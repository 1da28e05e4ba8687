// SPDX-License-Identifier: BSD-3-Clause
#include "algorithm/query_sample.hpp"

#include <gtest/gtest.h>

#include <set>
#include <vector>

namespace gpureg {
namespace {

TEST(QuerySample, OneRowOfEachRange) {
  for (const std::uint32_t rows : {1u, 2u, 7u, 100u, 4099u, 2'000'000'011u})
    for (const std::uint32_t count : {1u, 2u, 7u, 97u, 2806u}) {
      if (count > rows) continue;
      const QuerySample sample{rows, count, 0, 5};
      for (std::uint32_t k = 0; k < count; ++k) {
        const std::uint32_t row = sample.row(k);
        ASSERT_GE(row, std::uint64_t(k) * rows / count);
        ASSERT_LT(row, std::uint64_t(k + 1) * rows / count);
        ASSERT_EQ(sample.place_of(row), k);
      }
    }
}

TEST(QuerySample, EveryRowHasItsPlace) {
  for (const std::uint32_t count : {1u, 5u, 36u, 99u, 100u}) {
    const QuerySample sample{100, count, 0, 1};
    for (std::uint32_t row = 0; row < 100; ++row) {
      const std::uint64_t place = sample.place_of(row);
      EXPECT_LE(place * 100 / count, row);
      EXPECT_GT((place + 1) * 100 / count, row);
    }
  }
}

TEST(QuerySample, AllRowsAreEquallyLikely) {
  std::vector<int> drawn(40, 0);
  for (std::uint64_t seed = 0; seed < 4000; ++seed) {
    const QuerySample sample{40, 10, 0, seed};
    for (std::uint32_t k = 0; k < 10; ++k) ++drawn[sample.row(k)];
  }
  // 1,000 expected, standard deviation 27.
  for (const int n : drawn) EXPECT_NEAR(n, 1000, 140);
}

TEST(QuerySample, SearchesDrawOtherRows) {
  const auto samples = query_samples(100'000, 100'000, 4, 8192, 1);
  std::set<std::uint32_t> narrow;
  for (std::uint32_t k = 0; k < samples[0].count; ++k) narrow.insert(samples[0].row(k));
  int common = 0;
  for (std::uint32_t k = 0; k < samples[2].count; ++k)
    common += narrow.count(samples[2].row(k)) != 0;
  EXPECT_LT(common, 200);  // 79 expected
}

TEST(QuerySample, AsManyQueriesAsTheMatchesNeed) {
  const auto queries = [](std::uint32_t sources, std::uint32_t targets, std::uint32_t searches) {
    std::vector<std::uint32_t> out;
    for (const QuerySample& sample : query_samples(sources, targets, searches, 8192, 1))
      out.push_back(sample.count);
    return out;
  };
  using Counts = std::vector<std::uint32_t>;
  EXPECT_EQ(queries(20'000, 30'000, 4), (Counts{2806, 2806, 2806, 2806}));
  EXPECT_EQ(queries(20'000, 30'000, 2), (Counts{5612, 5612, 0, 0}));
  EXPECT_EQ(queries(1000, 30'000, 4), (Counts{1000, 4612, 1000, 4612}));
  EXPECT_EQ(queries(30'000, 1000, 4), (Counts{4612, 1000, 4612, 1000}));
  EXPECT_EQ(queries(1000, 1200, 4), (Counts{1000, 1200, 1000, 1200}));
}

}  // namespace
}  // namespace gpureg
