// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <flann/flann.hpp>
#include <random>
#include <set>

#include "cpu/common/stages.hpp"

namespace gpureg::cpu {
namespace {

struct Rows {
  std::vector<float> values;
  std::vector<std::uint8_t> valid;
  std::size_t dimension;
  std::size_t size() const { return valid.size(); }
  const float* row(std::size_t k) const { return values.data() + k * dimension; }
  FeatureRows view() const {
    return {values.data(), valid.data(), static_cast<std::uint32_t>(size()),
            static_cast<std::uint32_t>(dimension)};
  }
};

// Like histograms: clustered and with many zeros, so that neighbours are close to each other.
Rows random_rows(std::mt19937& random, std::size_t count, std::size_t dimension,
                 const std::vector<float>& centres, bool all_valid) {
  std::normal_distribution<float> noise(0, 2);
  Rows rows{std::vector<float>(count * dimension), std::vector<std::uint8_t>(count, 1), dimension};
  for (std::size_t k = 0; k < count; ++k) {
    const float* centre = centres.data() + random() % (centres.size() / dimension) * dimension;
    for (std::size_t d = 0; d < dimension; ++d)
      rows.values[k * dimension + d] = std::max(0.0f, centre[d] + noise(random));
    if (!all_valid && random() % 20 == 0) rows.valid[k] = 0;
  }
  return rows;
}

double squared_distance(const float* a, const float* b, std::size_t dimension) {
  double sum = 0;
  for (std::size_t d = 0; d < dimension; ++d) {
    const double difference = static_cast<double>(a[d]) - static_cast<double>(b[d]);
    sum += difference * difference;
  }
  return sum;
}

std::vector<float> random_centres(std::mt19937& random, std::size_t dimension) {
  std::uniform_real_distribution<float> value(-20, 40);
  std::vector<float> centres(20 * dimension);
  for (float& v : centres) v = value(random);
  return centres;
}

// Of two rows whose distances differ by less than float can tell (one rounding per dimension)
// either is a nearest neighbour.
double tolerance(std::size_t dimension) { return 1 + 6e-8 * static_cast<double>(dimension + 4); }

TEST(NearestFeatureOracle, FlannWithUnlimitedChecks) {
  std::mt19937 random(61);
  std::size_t cases = 0, different = 0;
  for (const std::size_t dimension : {2u, 16u, 33u, 34u, 66u, 153u}) {
    const auto centres = random_centres(random, dimension);
    const Rows rows = random_rows(random, 1500 + random() % 500, dimension, centres, true);
    const Rows queries = random_rows(random, 700, dimension, centres, true);
    constexpr std::size_t k = 3;
    std::vector<std::uint32_t> found(queries.size() * k);
    nearest_features(queries.view(), rows.view(), k, 0, queries.size(), found.data());

    const flann::Matrix<float> data(const_cast<float*>(rows.values.data()), rows.size(), dimension);
    const flann::Matrix<float> query(const_cast<float*>(queries.values.data()), queries.size(),
                                     dimension);
    flann::Index<flann::L2<float>> index(data, flann::KDTreeSingleIndexParams());
    index.buildIndex();
    std::vector<int> indices(queries.size() * k);
    std::vector<float> distances(queries.size() * k);
    flann::Matrix<int> indices_out(indices.data(), queries.size(), k);
    flann::Matrix<float> distances_out(distances.data(), queries.size(), k);
    index.knnSearch(query, indices_out, distances_out, k,
                    flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED));

    for (std::size_t q = 0; q < queries.size() * k; ++q) {
      ASSERT_LT(found[q], rows.size());
      const double ours = squared_distance(queries.row(q / k), rows.row(found[q]), dimension);
      const double theirs = squared_distance(
          queries.row(q / k), rows.row(static_cast<std::size_t>(indices[q])), dimension);
      EXPECT_LE(ours, theirs * tolerance(dimension));
      EXPECT_LE(theirs, ours * tolerance(dimension));
      ++cases;
      different += ours != theirs;
    }
  }
  EXPECT_GT(cases, 10000u);
  EXPECT_LE(different, cases / 1000) << "equal distances apart it is the same row";
}

TEST(NearestFeatureOracle, BruteForceInDoublePrecision) {
  std::mt19937 random(62);
  for (int repeat = 0; repeat < 40; ++repeat) {
    const std::size_t dimension = std::array{1u, 3u, 33u, 100u}[random() % 4];
    const auto centres = random_centres(random, dimension);
    const Rows rows = random_rows(random, 1 + random() % 400, dimension, centres, false);
    const Rows queries = random_rows(random, 1 + random() % 200, dimension, centres, false);
    const std::uint32_t k = 1 + random() % 8;
    std::vector<std::uint32_t> found(queries.size() * k);
    nearest_features(queries.view(), rows.view(), k, 0, queries.size(), found.data());
    for (std::size_t q = 0; q < queries.size(); ++q) {
      std::multiset<double> expected;
      for (std::size_t r = 0; r < rows.size() && queries.valid[q]; ++r)
        if (rows.valid[r])
          expected.insert(squared_distance(queries.row(q), rows.row(r), dimension));
      std::set<std::uint32_t> seen;
      auto nearest = expected.begin();
      for (std::uint32_t t = 0; t < k; ++t) {
        const std::uint32_t index = found[q * k + t];
        if (t >= expected.size()) {
          EXPECT_EQ(index, kNoValue);
          continue;
        }
        ASSERT_LT(index, rows.size());
        EXPECT_TRUE(rows.valid[index]);
        EXPECT_TRUE(seen.insert(index).second) << "a row twice";
        EXPECT_LE(squared_distance(queries.row(q), rows.row(index), dimension),
                  *nearest++ * tolerance(dimension));
      }
    }
  }
}

}  // namespace
}  // namespace gpureg::cpu
