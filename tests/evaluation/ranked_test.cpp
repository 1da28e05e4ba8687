// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "support/expect_error.hpp"

namespace gpureg::evaluation {
namespace {

// Pairs (0, 2) ... (0, n + 1), all with identity as their truth.
GroundTruth truth_of(int n) {
  GroundTruth truth;
  for (int k = 0; k < n; ++k) {
    truth.log.push_back({0, 2 + k, 1000, Eigen::Matrix4d::Identity()});
    truth.information.push_back({0, 2 + k, 1000, Eigen::Matrix<double, 6, 6>::Identity()});
  }
  return truth;
}

// Report k is about pair (0, 2 + k).
std::vector<Report> reports_of(const std::vector<std::pair<double, bool>>& scores) {
  std::vector<Report> reports;
  for (std::size_t k = 0; k < scores.size(); ++k) {
    Report report{0, 2 + static_cast<int>(k)};
    report.confidence = scores[k].first;
    if (!scores[k].second) report.transform(0, 3) = 1;
    reports.push_back(report);
  }
  return reports;
}

RankedScores rank(int n, const std::vector<std::pair<double, bool>>& scores) {
  return *evaluate(truth_of(n), reports_of(scores), true).strict_ranked;
}

TEST(Ranked, HandMadeExample) {
  // good, wrong, good, good, wrong of 4: precision 1, 1/2, 2/3, 3/4, 3/5; recall 1/4, 1/4, 2/4,
  // 3/4, 3/4
  const RankedScores s =
      rank(4, {{0.9, true}, {0.5, false}, {0.4, true}, {0.3, true}, {0.1, false}});
  EXPECT_DOUBLE_EQ(s.raw_recall, 0.75);
  EXPECT_DOUBLE_EQ(s.recall_at_50, 0.75);
  EXPECT_DOUBLE_EQ(s.recall_at_80, 0.25);
  EXPECT_DOUBLE_EQ(s.recall_at_95, 0.25);
  EXPECT_DOUBLE_EQ(s.recall_at_99, 0.25);
  EXPECT_DOUBLE_EQ(s.average_precision, 0.25 * (1 + 2.0 / 3 + 3.0 / 4));
}

TEST(Ranked, PerfectRankingIsWorthItsRecall) {
  const RankedScores s = rank(10, {{9, true},
                                   {8, true},
                                   {7, true},
                                   {6, true},
                                   {5, true},
                                   {4, true},
                                   {3, true},
                                   {2, true},
                                   {1, true},
                                   {0, false}});
  EXPECT_DOUBLE_EQ(s.average_precision, 0.9);
  EXPECT_DOUBLE_EQ(s.recall_at_99, 0.9);
}

TEST(Ranked, AWrongLeaderRuinsHighPrecisionForGood) {
  const RankedScores s = rank(4, {{1.0, false}, {0.5, true}, {0.4, true}, {0.3, true}});
  EXPECT_EQ(s.recall_at_95, 0);
  EXPECT_EQ(s.recall_at_80, 0);
  EXPECT_DOUBLE_EQ(s.recall_at_50, 0.75);
}

TEST(Ranked, TiesAreOneStepInWhateverOrderTheyCome) {
  // All equal: the only thresholds are "all" and "none", so 99 % precision is out of reach although
  // a good one came first.
  std::vector<std::pair<double, bool>> scores = {{0.5, true}, {0.5, true}, {0.5, false}};
  RankedScores s = rank(3, scores);
  EXPECT_EQ(s.recall_at_80, 0);
  EXPECT_DOUBLE_EQ(s.recall_at_50, 2.0 / 3);
  EXPECT_DOUBLE_EQ(s.average_precision, 2.0 / 3 * 2.0 / 3);
  std::reverse(scores.begin(), scores.end());
  EXPECT_EQ(rank(3, scores).average_precision, s.average_precision);
}

TEST(Ranked, PrecisionIsMetExactlyAtTheBound) {
  std::vector<std::pair<double, bool>> scores;
  for (int k = 0; k < 20; ++k) scores.push_back({1.0, k != 7});  // 19 of 20 = 95 %
  EXPECT_DOUBLE_EQ(rank(20, scores).recall_at_95, 0.95);
  scores.push_back({1.0, false});
  EXPECT_EQ(rank(21, scores).recall_at_95, 0);
}

TEST(Ranked, GeometricPrecisionForgivesWhatRecallDoesNotCount) {
  GroundTruth truth = truth_of(2);
  const GroundTruth all = truth_of(3);
  truth.all_log = all.log;
  truth.all_information = all.information;
  const Evaluation result =
      evaluate(truth, reports_of({{0.5, true}, {0.4, true}, {0.9, true}}), true);
  EXPECT_EQ(result.strict_ranked->recall_at_80, 0);
  EXPECT_DOUBLE_EQ(result.strict_ranked->average_precision, 0.5 * 1 / 2 + 0.5 * 2 / 3);
  EXPECT_EQ(result.geometric_ranked->recall_at_99, 1);
  EXPECT_EQ(result.geometric_ranked->average_precision, 1);
}

TEST(Ranked, NaNCannotBeRanked) {
  test::expect_error<InvalidArgument>([] { rank(1, {{std::nan(""), true}}); },
                                      {"confidence", "nan"});
  EXPECT_EQ(rank(1, {{INFINITY, true}}).raw_recall, 1);
}

// Against the definition, threshold by threshold, on random rankings with many ties.
TEST(Ranked, EqualsExhaustiveThresholds) {
  std::mt19937 random(5);
  for (int repeat = 0; repeat < 2000; ++repeat) {
    const int n = 1 + static_cast<int>(random() % 30);
    std::vector<std::pair<double, bool>> scores;
    for (int k = 0; k < n; ++k)
      scores.push_back({static_cast<double>(random() % 12), random() % 3 != 0});
    const int pairs = n + static_cast<int>(random() % 10);
    double best[4] = {0, 0, 0, 0}, area = 0, last = 0;
    const double wanted[4] = {0.5, 0.8, 0.95, 0.99};
    for (int threshold = 11; threshold >= 0; --threshold) {
      int good = 0, reported = 0;
      for (const auto& [score, right] : scores)
        if (score >= threshold) {
          ++reported;
          good += right;
        }
      if (reported == 0) continue;
      const double precision = static_cast<double>(good) / reported,
                   recall = static_cast<double>(good) / pairs;
      for (int k = 0; k < 4; ++k)
        if (precision >= wanted[k] - 1e-12) best[k] = std::max(best[k], recall);
      area += (recall - last) * precision;
      last = recall;
    }
    const RankedScores s = rank(pairs, scores);
    EXPECT_DOUBLE_EQ(s.recall_at_50, best[0]);
    EXPECT_DOUBLE_EQ(s.recall_at_80, best[1]);
    EXPECT_DOUBLE_EQ(s.recall_at_95, best[2]);
    EXPECT_DOUBLE_EQ(s.recall_at_99, best[3]);
    EXPECT_NEAR(s.average_precision, area, 1e-12);  // two orders of summation
    EXPECT_DOUBLE_EQ(s.raw_recall, last);
  }
}

}  // namespace
}  // namespace gpureg::evaluation
