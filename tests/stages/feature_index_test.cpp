// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/common/feature_index.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>

namespace gpureg::cpu {
namespace {

struct Rows {
  std::vector<float> values;
  std::vector<std::uint8_t> valid;
  std::uint32_t dimension;
  FeatureRows view() const {
    return {values.data(), valid.data(), static_cast<std::uint32_t>(valid.size()), dimension};
  }
};

/// levels > 0: so few different values that many distances are equal.
Rows random_rows(std::mt19937& random, std::size_t n, std::uint32_t dimension, int levels,
                 float scale) {
  Rows rows{{}, {}, dimension};
  std::uniform_real_distribution<float> value(-1, 1);
  for (std::size_t i = 0; i < n; ++i) {
    const bool valid = random() % 8 != 0;
    const float shift =
        3 * value(random);  // rows along a line, as features lie along a few directions
    for (std::uint32_t d = 0; d < dimension; ++d) {
      const float v = levels > 0 ? std::floor(value(random) * static_cast<float>(levels))
                                 : value(random) + shift;
      rows.values.push_back(valid ? v * scale : std::numeric_limits<float>::quiet_NaN());
    }
    rows.valid.push_back(valid);
  }
  return rows;
}

constexpr SearchVectors kVectors[] = {SearchVectors::kNarrow, SearchVectors::kWide,
                                      SearchVectors::kBytes};

std::vector<std::uint32_t> by_index(const Rows& queries, const Rows& rows, std::size_t grain,
                                    SearchVectors most = SearchVectors::kBytes) {
  const FeatureIndex order = index_features(queries.view()), index = index_features(rows.view());
  std::vector<std::uint32_t> out(queries.valid.size(), kNoValue), places(order.rows);
  std::iota(places.begin(), places.end(), 0u);
  for (std::size_t begin = 0; begin < order.rows; begin += grain)
    nearest_features(queries.view(), order, places, rows.view(), index, begin,
                     std::min<std::size_t>(begin + grain, order.rows), out.data(), most);
  return out;
}

std::vector<std::uint32_t> exhaustive(const Rows& queries, const Rows& rows) {
  std::vector<std::uint32_t> out(queries.valid.size());
  nearest_features(queries.view(), rows.view(), 1, 0, out.size(), out.data());
  return out;
}

TEST(FeatureIndex, EqualsExhaustiveSearch) {
  std::mt19937 random(1);
  for (const std::uint32_t dimension : {1u, 2u, 33u, 352u})
    for (const std::size_t n : {0, 1, 16, 17, 127, 129, 1500})
      for (const int levels : {0, 1, 2}) {
        const Rows queries = random_rows(random, 211, dimension, levels, 1),
                   rows = random_rows(random, n, dimension, levels, 1);
        const std::vector<std::uint32_t> expected = exhaustive(queries, rows);
        for (const SearchVectors most : kVectors)
          EXPECT_EQ(by_index(queries, rows, 50, most), expected)
              << dimension << " " << n << " " << levels << " " << static_cast<int>(most);
      }
}

// Bounds of products of bytes are wide where the values are far from zero, or on few axes.
TEST(FeatureIndex, EqualsExhaustiveSearchFarFromZero) {
  std::mt19937 random(6);
  for (const float shift : {0.0f, 1e3f, 1e6f})
    for (const std::uint32_t axes : {1u, 5u, 40u}) {
      Rows queries = random_rows(random, 150, 40, 0, 1), rows = random_rows(random, 900, 40, 0, 1);
      for (Rows* some : {&queries, &rows})
        for (std::size_t k = 0; k < some->values.size(); ++k)
          some->values[k] = (k % 40 < axes ? some->values[k] : 0.0f) + shift;
      for (const SearchVectors most : kVectors)
        EXPECT_EQ(by_index(queries, rows, 70, most), exhaustive(queries, rows))
            << shift << " " << axes << " " << static_cast<int>(most);
    }
}

TEST(FeatureIndex, EqualRowsGoToTheLowestIndex) {
  std::mt19937 random(2);
  Rows rows = random_rows(random, 40, 33, 0, 50);
  for (int copy = 0; copy < 30; ++copy) {
    rows.values.insert(rows.values.end(), rows.values.begin(), rows.values.begin() + 40 * 33);
    rows.valid.insert(rows.valid.end(), rows.valid.begin(), rows.valid.begin() + 40);
  }
  const std::vector<std::uint32_t> found = by_index(rows, rows, 64);
  for (std::size_t i = 0; i < found.size(); ++i)
    EXPECT_EQ(found[i], rows.valid[i] ? i % 40 : kNoValue);
}

// A plane has thousands of equal features. They are searched once, and only the first is searched
// in; 0 and -0 are at the same distance from everything.
TEST(FeatureIndex, KeepsEqualRowsOnce) {
  std::mt19937 random(5);
  Rows rows = random_rows(random, 100, 7, 1, 1);
  const std::size_t size = rows.values.size();
  for (std::size_t k = 0; k < size; ++k) rows.values.push_back(-0.0f);
  for (std::size_t k = 0; k < size; ++k) rows.values.push_back(0.0f);
  rows.valid.resize(300, 1);
  const FeatureIndex index = index_features(rows.view());
  std::vector<int> listed(300, 0);
  for (std::uint32_t k = 0; k < index.rows; ++k)
    for (std::uint32_t i = index.row[k]; i != kNoValue; i = index.next_equal[i]) {
      ++listed[i];
      for (std::size_t d = 0; d < 7; ++d)
        EXPECT_EQ(rows.values[i * 7 + d], rows.values[index.row[k] * 7 + d]);
    }
  for (std::size_t i = 0; i < 300; ++i) EXPECT_EQ(listed[i], rows.valid[i]) << i;
  EXPECT_LE(index.rows, 101u);
  EXPECT_EQ(by_index(rows, rows, 30), exhaustive(rows, rows));
}

TEST(FeatureIndex, DistancesThatOverflowAreNoDistances) {
  std::mt19937 random(3);
  for (const float scale : {1e-30f, 1e18f, 1e30f}) {
    const Rows queries = random_rows(random, 90, 33, 0, scale),
               rows = random_rows(random, 300, 33, 0, scale);
    for (const SearchVectors most : kVectors)
      EXPECT_EQ(by_index(queries, rows, 90, most), exhaustive(queries, rows)) << scale;
  }
}

TEST(FeatureIndex, AnySplitOfTheQueriesIsTheSame) {
  std::mt19937 random(4);
  const Rows queries = random_rows(random, 400, 33, 2, 1),
             rows = random_rows(random, 700, 33, 2, 1);
  const std::vector<std::uint32_t> whole = by_index(queries, rows, 400);
  for (const std::size_t grain : {1, 7, 128}) EXPECT_EQ(by_index(queries, rows, grain), whole);
}

}  // namespace
}  // namespace gpureg::cpu
