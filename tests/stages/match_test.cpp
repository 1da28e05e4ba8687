// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "cpu/common/stages.hpp"

namespace gpureg::cpu {
namespace {

struct ValidRows {
  std::vector<float> values;
  std::vector<std::uint8_t> valid;
  FeatureRows view(std::uint32_t dimension) const {
    return {values.data(), valid.data(), static_cast<std::uint32_t>(valid.size()), dimension};
  }
};

ValidRows random_rows(std::mt19937& random, std::size_t n, std::uint32_t dimension, bool coarse) {
  ValidRows rows;
  std::uniform_real_distribution<float> value(0, 100);
  for (std::size_t k = 0; k < n * dimension; ++k)
    rows.values.push_back(coarse ? std::floor(value(random) / 40) : value(random));
  for (std::size_t k = 0; k < n; ++k) rows.valid.push_back(random() % 10 != 0);
  return rows;
}

/// The definition: a chain of fused multiply-adds over the dimensions, ties to the lower index.
std::vector<std::uint32_t> by_definition(const ValidRows& queries, const ValidRows& rows,
                                         std::uint32_t dimension, std::uint32_t k) {
  std::vector<std::uint32_t> out;
  for (std::size_t q = 0; q < queries.valid.size(); ++q) {
    std::vector<std::pair<float, std::uint32_t>> all;
    for (std::size_t i = 0; i < rows.valid.size(); ++i) {
      float sum = 0;
      for (std::uint32_t d = 0; d < dimension; ++d) {
        const float difference = queries.values[q * dimension + d] - rows.values[i * dimension + d];
        sum = std::fmaf(difference, difference, sum);
      }
      if (rows.valid[i] && queries.valid[q]) all.emplace_back(sum, static_cast<std::uint32_t>(i));
    }
    std::sort(all.begin(), all.end());
    for (std::uint32_t t = 0; t < k; ++t) out.push_back(t < all.size() ? all[t].second : kNoValue);
  }
  return out;
}

TEST(NearestFeatures, IsTheDefinitionForAnyDimensionAndCount) {
  std::mt19937 random(1);
  for (const std::uint32_t dimension : {1u, 3u, 32u, 33u, 64u, 352u})
    for (const std::size_t n : {std::size_t(0), std::size_t(1), std::size_t(3), std::size_t(16),
                                std::size_t(17), std::size_t(150)})
      for (const std::uint32_t k : {1u, 2u, 16u}) {
        const ValidRows queries = random_rows(random, 37, dimension, false),
                        rows = random_rows(random, n, dimension, n % 2 == 0);
        std::vector<std::uint32_t> out(37 * k);
        nearest_features(queries.view(dimension), rows.view(dimension), k, 0, 37, out.data());
        EXPECT_EQ(out, by_definition(queries, rows, dimension, k))
            << dimension << " " << n << " " << k;
      }
}

TEST(NearestFeatures, TiesGoToTheLowerIndex) {
  std::mt19937 random(2);
  const ValidRows queries = random_rows(random, 200, 2, true),
                  rows = random_rows(random, 400, 2, true);
  std::vector<std::uint32_t> out(200 * 5);
  nearest_features(queries.view(2), rows.view(2), 5, 0, 200, out.data());
  EXPECT_EQ(out, by_definition(queries, rows, 2, 5));
}

TEST(NearestFeatures, AnySplitOfTheQueriesIsTheSame) {
  std::mt19937 random(3);
  const ValidRows queries = random_rows(random, 101, 33, false),
                  rows = random_rows(random, 300, 33, false);
  std::vector<std::uint32_t> whole(101), parts(101);
  nearest_features(queries.view(33), rows.view(33), 1, 0, 101, whole.data());
  for (std::size_t begin = 0; begin < 101; begin += 7)
    nearest_features(queries.view(33), rows.view(33), 1, begin,
                     std::min<std::size_t>(begin + 7, 101), parts.data() + begin);
  EXPECT_EQ(whole, parts);
}

}  // namespace
}  // namespace gpureg::cpu
