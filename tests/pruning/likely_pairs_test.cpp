// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "pruning/agreement.hpp"
#include "pruning/likeness.hpp"
#include "pruning/summarize.hpp"

namespace gpureg::test {
namespace {

using pruning::Edge;
using pruning::Likeness;
using pruning::Matrix;
using pruning::Partner;
using pruning::Partners;
using pruning::Summary;

constexpr float kRadius = 0.25f;
constexpr std::size_t kDimension = 12;

/// Points of a place with features and normals of their own.
struct Place {
  std::vector<Eigen::Vector3f> points, normals;
  std::vector<float> features;

  pruning::FeatureView view() const { return {features.data(), points.size(), kDimension}; }
};

Eigen::Vector3f random_vector(std::mt19937& random, float scale) {
  std::uniform_real_distribution<float> uniform(-scale, scale);
  const float x = uniform(random), y = uniform(random);
  return {x, y, uniform(random)};
}

Place make_place(unsigned seed, std::size_t count = 150) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  Place out;
  for (std::size_t k = 0; k < count; ++k) {
    out.points.push_back(random_vector(random, 3));
    out.normals.push_back(random_vector(random, 1).normalized());
    for (std::size_t d = 0; d < kDimension; ++d) {
      const float value = uniform(random);
      out.features.push_back(value * value);
    }
  }
  return out;
}

/// A part of a place as another scan has it: moved, with noise.
Place seen(const Place& place, std::size_t begin, std::size_t end, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> noise(0, 0.02f);
  const Eigen::Quaternionf turn(
      Eigen::AngleAxisf(static_cast<float>(seed % 7), Eigen::Vector3f(1, 2, 3).normalized()));
  const Eigen::Vector3f shift = random_vector(random, 5);
  Place out;
  for (std::size_t k = begin; k < end; ++k) {
    out.points.push_back(turn * place.points[k] + shift + random_vector(random, 0.02f));
    out.normals.push_back(turn * place.normals[k]);
    for (std::size_t d = 0; d < kDimension; ++d)
      out.features.push_back(place.features[k * kDimension + d] + noise(random));
  }
  return out;
}

std::vector<Summary> summaries_of(const std::vector<Place>& places) {
  std::vector<pruning::FeatureView> views;
  for (const Place& place : places) views.push_back(place.view());
  const Matrix words = pruning::learn_words(views, 8);
  std::vector<Summary> out;
  for (const Place& place : places)
    out.push_back(pruning::summarize(place.view(), place.points, place.normals, kRadius, words));
  return out;
}

/// Scans along walls: each sees half of what the next one sees.
std::vector<Place> make_walk(std::size_t count, unsigned seed) {
  const Place wall = make_place(seed, 100 * count + 100);
  std::vector<Place> out;
  for (std::size_t k = 0; k < count; ++k)
    out.push_back(seen(wall, 100 * k, 100 * k + 200, seed + static_cast<unsigned>(k)));
  return out;
}

double agreement_of(const Summary& source, const Summary& target) {
  pruning::Agreement agreement;
  agreement.set_target(target);
  return agreement.with(source);
}

/// The definition, word by word.
double plain_agreement(const Summary& source, const Summary& target) {
  const auto rows = static_cast<std::uint32_t>(source.points.size()),
             columns = static_cast<std::uint32_t>(target.points.size());
  const auto product = [&](std::uint32_t i, std::uint32_t j) {
    int sum = 0;
    for (std::size_t d = 0; d < kDimension; ++d)
      sum += source.features[i * kDimension + d] * target.features[j * kDimension + d];
    return std::max(sum, 0);
  };
  const auto two_best = [](std::uint32_t count, const auto& value) {
    std::vector<std::pair<int, std::uint32_t>> order;
    for (std::uint32_t k = 0; k < count; ++k) order.emplace_back(-value(k), k);
    std::sort(order.begin(), order.end());
    std::set<std::uint32_t> best;
    for (std::size_t k = 0; k < std::min<std::size_t>(2, count); ++k) best.insert(order[k].second);
    return best;
  };
  std::vector<std::pair<std::uint32_t, std::uint32_t>> matches;
  for (std::uint32_t i = 0; i < rows; ++i)
    for (std::uint32_t j : two_best(columns, [&](std::uint32_t at) { return product(i, at); }))
      if (two_best(rows, [&](std::uint32_t at) { return product(at, j); }).count(i) > 0)
        matches.emplace_back(i, j);
  const auto compatible = [&](std::size_t x, std::size_t y) {
    const auto [a, p] = matches[x];
    const auto [b, q] = matches[y];
    const Eigen::Vector3f d = source.points[b] - source.points[a],
                          e = target.points[q] - target.points[p];
    if (std::abs(d.norm() - e.norm()) > 0.6f * kRadius) return false;
    if (std::min(d.norm(), e.norm()) < 0.8f * kRadius) return false;
    const float turns[] = {
        source.normals[a].dot(source.normals[b]) - target.normals[p].dot(target.normals[q]),
        source.normals[a].dot(d) / d.norm() - target.normals[p].dot(e) / e.norm(),
        source.normals[b].dot(d) / d.norm() - target.normals[q].dot(e) / e.norm()};
    return std::all_of(std::begin(turns), std::end(turns),
                       [](float turn) { return std::abs(turn) <= 0.3f; });
  };
  int strongest = 0;
  for (std::size_t x = 0; x < matches.size(); ++x) {
    int support = 0;
    for (std::size_t y = 0; y < matches.size(); ++y)
      for (std::size_t z = 0; z < matches.size(); ++z)
        support += x != y && z != x && z != y && compatible(std::min(x, y), std::max(x, y)) &&
                   compatible(std::min(x, z), std::max(x, z)) &&
                   compatible(std::min(y, z), std::max(y, z));
    strongest = std::max(strongest, support);
  }
  return std::log(1 + std::sqrt(static_cast<double>(strongest)));
}

TEST(LikelyPairs, AgreementIsThatOfItsDefinition) {
  const Place place = make_place(5);
  const std::vector<Summary> clouds = summaries_of(
      {seen(place, 0, 60, 1), seen(place, 30, 90, 2), make_place(6, 60), make_place(7, 1)});
  for (const Summary& a : clouds)
    for (const Summary& b : clouds)
      // The logarithms are of different libraries.
      EXPECT_NEAR(agreement_of(a, b), plain_agreement(a, b), 1e-12);
  EXPECT_GT(agreement_of(clouds[0], clouds[1]), agreement_of(clouds[0], clouds[2]));
}

TEST(LikelyPairs, KeyPointsAreApartAndHaveFeaturesAndNormals) {
  Place place = make_place(8, 2000);
  place.normals[3].setZero();
  std::fill_n(place.features.begin() + 5 * kDimension, kDimension, 0.0f);
  const Summary summary = summaries_of({place}).front();
  EXPECT_LE(summary.points.size(), 256u);
  EXPECT_GT(summary.points.size(), 100u);
  ASSERT_EQ(summary.normals.size(), summary.points.size());
  ASSERT_EQ(summary.features.size(), summary.points.size() * kDimension);
  for (std::size_t a = 0; a < summary.points.size(); ++a) {
    EXPECT_NE(summary.points[a], place.points[3]);
    EXPECT_NE(summary.points[a], place.points[5]);
    for (std::size_t b = 0; b < a; ++b)
      EXPECT_GE((summary.points[a] - summary.points[b]).norm(), 0.6f * kRadius * 0.999f);
  }
}

TEST(LikelyPairs, ThirdCloudsHelp) {
  const std::vector<Likeness> known{
      {{0, 1}, 5}, {{1, 2}, 4}, {{0, 3}, 2}, {{1, 3}, -1}, {{3, 4}, -2}};
  const Partners partners =
      pruning::partners_of(pruning::with_third_clouds(known, known, 5, 9, 1), 5);
  const auto value = [&](std::uint32_t a, std::uint32_t b) {
    for (const Partner& partner : partners[a])
      if (partner.cloud == b) return partner.value;
    return -99.0f;
  };
  EXPECT_EQ(value(0, 2), 4);  // by cloud 1
  EXPECT_EQ(value(2, 0), 4);
  EXPECT_EQ(value(0, 1), 5);       // cloud 3 is like 0 only
  EXPECT_EQ(value(1, 3), -1 + 2);  // by cloud 0
  EXPECT_EQ(value(3, 4), -2);
  EXPECT_EQ(value(0, 4), -99);  // no cloud is like both
  EXPECT_EQ(pruning::edges_of(pruning::with_third_clouds(known, known, 5, 1, 2)),
            (std::vector<Edge>{{0, 1}, {0, 2}, {0, 3}, {3, 4}}));  // 0 before 1 for 2
  // Other steps: 2 and 3 are like 4.
  const std::vector<Likeness> steps{{{2, 4}, 3}, {{3, 4}, 6}};
  EXPECT_EQ(pruning::edges_of(pruning::with_third_clouds({}, steps, 5, 9, 1)),
            (std::vector<Edge>{{2, 3}}));
}

TEST(LikelyPairs, CloudsThatAreLikeManyGetMorePairs) {
  // 0 to 3 are alike, all weakly like 4; 5 is like nothing.
  const std::vector<Likeness> pairs{{{0, 1}, 9}, {{0, 2}, 8}, {{0, 3}, 7},    {{0, 4}, 1},
                                    {{1, 2}, 6}, {{1, 3}, 5}, {{2, 3}, 5.9f}, {{4, 5}, -3}};
  const auto chosen = [&](std::size_t neighbors) { return pruning::choose(pairs, 6, neighbors); };
  // The nearest one of each.
  EXPECT_EQ(chosen(1), (std::vector<Edge>{{0, 1}, {0, 2}, {0, 3}, {0, 4}, {4, 5}}));
  // (2, 3) before (1, 2): 5.9 less 3/8 of 7 + 6.45, 6 less 3/8 of 7.5 + 7.
  EXPECT_EQ(chosen(2), (std::vector<Edge>{{0, 1}, {0, 2}, {0, 3}, {0, 4}, {2, 3}, {4, 5}}));
  EXPECT_EQ(chosen(9).size(), pairs.size());
}

TEST(LikelyPairs, SimilarDescriptorsAreThoseOfBruteForce) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  std::vector<Summary> clouds(150);
  for (Summary& cloud : clouds) {
    for (std::size_t d = 0; d < 12; ++d) cloud.descriptor.push_back(normal(random));
  }
  const pruning::LikenessModel model(clouds, 2);
  const Partners all = model.similar(clouds.size()), some = model.similar(4);
  // Without key points, pairs compared one by one, in double, are alike by their descriptors.
  std::vector<pruning::Edge> edges;
  for (std::uint32_t a = 0; a < clouds.size(); ++a)
    for (std::uint32_t b = a + 1; b < clouds.size(); ++b) edges.emplace_back(a, b);
  std::map<pruning::Edge, float> expected;
  for (const pruning::Likeness& pair : model.compare(edges)) expected[pair.edge] = pair.value;
  for (std::uint32_t k = 0; k < clouds.size(); ++k) {
    ASSERT_EQ(all[k].size(), clouds.size() - 1);
    for (const pruning::Partner& partner : all[k])
      EXPECT_NEAR(partner.value, expected.at(std::minmax(k, partner.cloud)), 1e-5f);
    ASSERT_EQ(some[k].size(), 4u);
    for (std::size_t p = 0; p + 1 < all[k].size(); ++p)
      EXPECT_GE(all[k][p].value, all[k][p + 1].value);
    for (std::size_t p = 0; p < 4; ++p) EXPECT_EQ(some[k][p].cloud, all[k][p].cloud);
  }
}

TEST(LikelyPairs, FindsTheNeighborsOfAWalk) {
  std::vector<Place> places;
  for (unsigned walk = 0; walk < 5; ++walk)
    for (Place& place : make_walk(8, 100 * walk + 1)) places.push_back(std::move(place));
  const std::vector<Summary> clouds = summaries_of(places);
  pruning::Options options;
  options.neighbors = 2;
  options.threads = 1;
  const std::vector<Pair> one = pruning::likely_pairs(clouds, options);
  options.threads = 3;
  const std::vector<Pair> three = pruning::likely_pairs(clouds, options);
  std::set<Edge> found;
  ASSERT_EQ(one.size(), three.size());
  for (std::size_t k = 0; k < one.size(); ++k) {
    EXPECT_EQ(one[k].source, three[k].source);
    EXPECT_EQ(one[k].target, three[k].target);
    EXPECT_GT(one[k].source, one[k].target);
    EXPECT_TRUE(found.insert({one[k].target, one[k].source}).second);
  }
  EXPECT_LE(found.size(), 80u);
  for (std::uint32_t k = 0; k + 1 < clouds.size(); ++k)
    if (k % 8 != 7) EXPECT_EQ(found.count({k, k + 1}), 1u) << k;
}

TEST(LikelyPairs, OddSets) {
  EXPECT_TRUE(pruning::likely_pairs(std::vector<Summary>{}).empty());
  EXPECT_TRUE(pruning::likely_pairs(std::vector<Summary>(1)).empty());
  pruning::Options options;
  options.neighbors = 2;
  EXPECT_EQ(pruning::likely_pairs(std::vector<Summary>(3), options).size(), 3u);  // empty clouds
  options.neighbors = 1;
  options.consecutive = 1;
  // 0 is the first of equals for all, and 1 for 0.
  EXPECT_EQ(pruning::likely_pairs(std::vector<Summary>(4), options).size(), 5u);
}

}  // namespace
}  // namespace gpureg::test
