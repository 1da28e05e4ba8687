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
using pruning::Summary;

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

TEST(Pruning, WordsComeWithTheRarestFirst) {
  // One centre has ten times as many features as each of the others.
  std::vector<float> rows;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> noise(0, 0.02f);
  for (std::size_t k = 0; k < 120; ++k)
    for (std::size_t d = 0; d < 4; ++d)
      rows.push_back((d == (k < 100 ? 0 : 1 + k % 2) ? 1.0f : 0.0f) + noise(random));
  const Matrix words = pruning::learn_words({view(rows, 4)}, 3);
  ASSERT_EQ(words.rows, 3u);
  EXPECT_GT(words.data[2 * 4], words.data[0]);
  EXPECT_GT(words.data[2 * 4], words.data[4]);
}

TEST(Pruning, ErrorsNameTheField) {
  const std::vector<float> cloud = place(1, 1, 10, 5);
  expect_error<InvalidArgument>([&] { pruning::learn_words({view(cloud, 5)}, 0); }, {"words", "0"});
  expect_error<InvalidArgument>([&] { pruning::learn_words({view(cloud, 5), view(cloud, 10)}, 2); },
                                {"clouds[1]", "10", "5"});
  const Matrix words = pruning::learn_words({view(cloud, 5)}, 2);
  expect_error<InvalidArgument>([&] { pruning::describe(view(cloud, 10), words); }, {"10", "5"});
  Summary one, other;
  one.descriptor = {1, 0};
  other.descriptor = {1};
  expect_error<InvalidArgument>([&] { pruning::likely_pairs(std::vector<Summary>{one, other}); },
                                {"clouds[1].descriptor", "1", "2"});
  pruning::Options options;
  options.neighbors = 0;
  expect_error<InvalidArgument>([&] { options.validate(); }, {"neighbors", "0"});
  expect_error<InvalidArgument>(
      [&] { pruning::likely_pairs(std::vector<PreparedCloud>{PreparedCloud()}); }, {"empty"});
}

}  // namespace
}  // namespace gpureg::test
