// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/pruning.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "gpureg/error.hpp"
#include "support/expect_error.hpp"

namespace gpureg::test {
namespace {

using pruning::FeatureView;
using pruning::Matrix;

/// Features around a few centres: those of one place differ from those of another.
std::vector<float> place(unsigned kind, unsigned seed, std::size_t rows, std::size_t dimension) {
  std::mt19937 centres(kind), noise(1000 * kind + seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  constexpr std::size_t kCentres = 5;
  std::vector<float> centre(kCentres * dimension), out;
  for (float& v : centre) v = uniform(centres);
  for (std::size_t k = 0; k < rows; ++k)
    for (std::size_t d = 0; d < dimension; ++d)
      out.push_back(centre[k % kCentres * dimension + d] + 0.02f * uniform(noise));
  return out;
}

FeatureView view(const std::vector<float>& rows, std::size_t dimension) {
  return {rows.data(), rows.size() / dimension, dimension};
}

Matrix descriptors_of(const std::vector<std::vector<float>>& clouds, std::size_t dimension) {
  std::vector<FeatureView> views;
  for (const auto& cloud : clouds) views.push_back(view(cloud, dimension));
  const Matrix words = pruning::learn_words(views, 8);
  Matrix out;
  out.rows = clouds.size();
  out.columns = words.rows * words.columns;
  for (const FeatureView& cloud : views)
    for (const float v : pruning::describe(cloud, words)) out.data.push_back(v);
  return out;
}

TEST(Pruning, FindsCloudsOfTheSamePlace) {
  std::vector<std::vector<float>> clouds;
  for (unsigned k = 0; k < 6; ++k) clouds.push_back(place(k % 3, k, 300, 33));
  const std::vector<Pair> pairs = pruning::nearest_pairs(descriptors_of(clouds, 33), 1);
  ASSERT_EQ(pairs.size(), 3u);
  for (std::uint32_t k = 0; k < 3; ++k) {
    EXPECT_EQ(pairs[k].target, k);
    EXPECT_EQ(pairs[k].source, k + 3);
  }
}

TEST(Pruning, DescriptorsHaveUnitLengthOrAreZero) {
  const std::vector<float> cloud = place(1, 1, 200, 7), zeros(70, 0.0f);
  const Matrix words = pruning::learn_words({view(cloud, 7)}, 4);
  double squares = 0;
  for (const float v : pruning::describe(view(cloud, 7), words)) squares += double(v) * double(v);
  EXPECT_NEAR(squares, 1, 1e-5);  // 28 floats
  for (const float v : pruning::describe(view(zeros, 7), words)) EXPECT_EQ(v, 0);
  EXPECT_EQ(pruning::describe({}, words).size(), 28u);
}

TEST(Pruning, WordsAreNotMoreThanFeatures) {
  const std::vector<float> cloud = place(1, 1, 3, 5);
  EXPECT_EQ(pruning::learn_words({view(cloud, 5)}, 64).rows, 3u);
  EXPECT_EQ(pruning::learn_words({}, 64).rows, 0u);
  // Equal features leave centres without a feature: those must stay numbers.
  const std::vector<float> equal(40, 0.5f);
  for (const float v : pruning::learn_words({view(equal, 4)}, 5).data)
    EXPECT_TRUE(std::isfinite(v));
}

TEST(Pruning, NearestPairsAgreeWithTheirDefinition) {
  constexpr std::size_t kRows = 300, kColumns = 12;
  constexpr std::uint32_t kNeighbors = 4;
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  Matrix rows{std::vector<float>(kRows * kColumns), kRows, kColumns};
  for (float& v : rows.data) v = normal(random);
  std::vector<std::vector<char>> near(kRows, std::vector<char>(kRows, 0));
  for (std::size_t i = 0; i < kRows; ++i) {
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t j = 0; j < kRows; ++j) {
      if (i == j) continue;
      double product = 0;
      for (std::size_t d = 0; d < kColumns; ++d)
        product += double(rows.data[i * kColumns + d]) * double(rows.data[j * kColumns + d]);
      order.emplace_back(-product, j);
    }
    std::sort(order.begin(), order.end());
    for (std::uint32_t k = 0; k < kNeighbors; ++k)
      near[std::min(i, order[k].second)][std::max(i, order[k].second)] = 1;
  }
  std::size_t expected = 0;
  for (const auto& row : near)
    for (const char v : row) expected += static_cast<std::size_t>(v);
  const std::vector<Pair> one = pruning::nearest_pairs(rows, kNeighbors, 1),
                          two = pruning::nearest_pairs(rows, kNeighbors, 2);
  ASSERT_EQ(one.size(), expected);
  ASSERT_EQ(two.size(), expected);
  for (std::size_t k = 0; k < expected; ++k) {
    EXPECT_TRUE(near[one[k].target][one[k].source]);
    EXPECT_EQ(one[k].source, two[k].source);
    EXPECT_EQ(one[k].target, two[k].target);
  }
}

TEST(Pruning, ErrorsNameTheField) {
  const std::vector<float> cloud = place(1, 1, 10, 5);
  expect_error<InvalidArgument>([&] { pruning::learn_words({view(cloud, 5)}, 0); }, {"words", "0"});
  expect_error<InvalidArgument>([&] { pruning::learn_words({view(cloud, 5), view(cloud, 10)}, 2); },
                                {"clouds[1]", "10", "5"});
  const Matrix words = pruning::learn_words({view(cloud, 5)}, 2);
  expect_error<InvalidArgument>([&] { pruning::describe(view(cloud, 10), words); }, {"10", "5"});
  expect_error<InvalidArgument>([&] { pruning::nearest_pairs(words, 0); }, {"k", "0"});
  pruning::Options options;
  options.neighbors = 0;
  expect_error<InvalidArgument>([&] { options.validate(); }, {"neighbors"});
}

}  // namespace
}  // namespace gpureg::test
