// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "support/expect_error.hpp"

namespace gpureg::evaluation {
namespace {

using Information = Eigen::Matrix<double, 6, 6>;

Eigen::Isometry3d random_pose(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                      .normalized()
                      .matrix();
  pose.translation() = Eigen::Vector3d(normal(random), normal(random), normal(random));
  return pose;
}

Eigen::Matrix4d shifted(double x) {
  Eigen::Matrix4d t = Eigen::Matrix4d::Identity();
  t(0, 3) = x;
  return t;
}

// Redwood's matrix of points, from the protocol's definition: sum of A'A, A = [I | 2 [p]x'].
Information information_of(const std::vector<Eigen::Vector3d>& points) {
  Information sum = Information::Zero();
  for (const Eigen::Vector3d& p : points) {
    Eigen::Matrix<double, 3, 6> a;
    a << Eigen::Matrix3d::Identity(),
        2 * (Eigen::Matrix3d() << 0, p.z(), -p.y(), -p.z(), 0, p.x(), p.y(), -p.x(), 0).finished();
    sum += a.transpose() * a;
  }
  return sum;
}

GroundTruth truth_of(const std::vector<std::pair<int, int>>& pairs) {
  GroundTruth truth;
  for (const auto& [i, j] : pairs) {
    truth.log.push_back({i, j, 10, Eigen::Matrix4d::Identity()});
    truth.information.push_back({i, j, 10, Information::Identity() * 50});
  }
  return truth;
}

TEST(RedwoodError, OfAPureTranslationIsItsLength) {
  EXPECT_DOUBLE_EQ(
      redwood_error(Eigen::Matrix4d::Identity(), shifted(0.3), Information::Identity() * 7), 0.3);
  EXPECT_EQ(redwood_error(shifted(1), shifted(1), Information::Identity()), 0);
}

// The matrix is the first-order model of the points' RMSE, so for small errors both must agree to
// second order.
TEST(RedwoodError, IsTheRmseOfThePointsForSmallErrors) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  for (int repeat = 0; repeat < 200; ++repeat) {
    std::vector<Eigen::Vector3d> points(100);
    for (Eigen::Vector3d& p : points)
      p = 2 * Eigen::Vector3d(normal(random), normal(random), normal(random));
    const Eigen::Isometry3d truth = random_pose(random);
    Eigen::Isometry3d error = Eigen::Isometry3d::Identity();
    error.linear() =
        Eigen::AngleAxisd(
            1e-3 * normal(random),
            Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized())
            .matrix();
    error.translation() = 1e-3 * Eigen::Vector3d(normal(random), normal(random), normal(random));
    double sum = 0;
    for (const Eigen::Vector3d& p : points) sum += (error * p - p).squaredNorm();
    const double rmse = std::sqrt(sum / 100);
    const double measured =
        redwood_error(truth.matrix(), (truth * error).matrix(), information_of(points));
    EXPECT_NEAR(measured, rmse, 0.01 * rmse);  // second-order terms: the angle (1e-3) times a few
  }
}

TEST(RedwoodError, TakesTheShortWayRound) {
  Information information = Information::Zero();
  information.diagonal() << 1, 1, 1, 10, 20, 30;
  for (const double degrees : {179.0, 181.0, 350.0, -10.0}) {
    Eigen::Isometry3d t = Eigen::Isometry3d::Identity();
    t.linear() = Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitZ()).matrix();
    t.translation() << 0.1, 0.2, 0.3;
    const double half = std::sin(std::abs(degrees) * M_PI / 360);
    EXPECT_NEAR(redwood_error(Eigen::Matrix4d::Identity(), t.matrix(), information),
                std::sqrt(0.14 + 30 * half * half), 1e-12);
  }
}

TEST(RedwoodError, RefusesAnInformationMatrixWithoutCorrespondences) {
  test::expect_error<InvalidArgument>(
      [] { redwood_error(shifted(0), shifted(0), Information::Zero()); }, {"information(0, 0)"});
}

TEST(RedwoodError, NaNIsNotZero) {
  EXPECT_TRUE(
      std::isnan(redwood_error(shifted(0), shifted(std::nan("")), Information::Identity())));
}

TEST(Evaluate, CountsOnlyPairsFurtherApartThanOne) {
  const GroundTruth truth = truth_of({{0, 1}, {0, 2}, {1, 4}, {3, 2}});
  const std::vector<Report> reports = {{0, 1, shifted(0)},
                                       {0, 2, shifted(0)},
                                       {4, 1, shifted(0)},
                                       {2, 2, shifted(0)},
                                       {3, 2, shifted(0)}};
  const Evaluation result = evaluate(truth, reports, false);
  EXPECT_EQ(result.strict.ground_truth, 2);
  EXPECT_EQ(result.strict.reported, 1);
  EXPECT_EQ(result.strict.good, 1);
  EXPECT_FALSE(result.geometric.has_value());
  EXPECT_FALSE(result.strict_ranked.has_value());
}

TEST(Evaluate, TwentyCentimetresAreGoodAndMoreIsNot) {
  const GroundTruth truth = truth_of({{0, 2}});
  EXPECT_EQ(evaluate(truth, {{0, 2, shifted(0.2 - 1e-9)}}, false).strict.good, 1);
  EXPECT_EQ(evaluate(truth, {{0, 2, shifted(0.2 + 1e-9)}}, false).strict.good, 0);
  EXPECT_EQ(evaluate(truth, {{0, 2, shifted(std::nan(""))}}, false).strict.good, 0);
}

TEST(Evaluate, DuplicatesCountTwice) {
  const GroundTruth truth = truth_of({{0, 2}, {0, 3}, {0, 4}});
  const Evaluation result =
      evaluate(truth, {{0, 2, shifted(0)}, {0, 2, shifted(0)}, {0, 2, shifted(9)}}, false);
  EXPECT_EQ(result.strict.reported, 3);
  EXPECT_EQ(result.strict.good, 2);
  EXPECT_EQ(result.strict.good_recall, 2);
}

TEST(Evaluate, OfATruthListedTwiceTheLastHoldsAndBothCount) {
  GroundTruth truth = truth_of({{0, 2}, {0, 2}});
  truth.log[0].transform = shifted(5);
  const Evaluation result = evaluate(truth, {{0, 2, shifted(0)}}, false);
  EXPECT_EQ(result.strict.good, 1);
  EXPECT_EQ(result.strict.ground_truth, 2);
}

TEST(Evaluate, NothingReportedIsPreciseAndNothingToFindIsNoRecall) {
  const Evaluation nothing = evaluate(truth_of({{0, 2}}), {}, true);
  EXPECT_EQ(nothing.strict.precision(), 1);
  EXPECT_EQ(nothing.strict.recall(), 0);
  EXPECT_EQ(nothing.strict_ranked->raw_recall, 0);
  const Evaluation empty = evaluate({}, {{0, 2, shifted(0)}}, true);
  EXPECT_EQ(empty.strict.recall(), 0);
  EXPECT_EQ(empty.strict.precision(), 0);
  EXPECT_EQ(empty.strict_ranked->average_precision, 0);
}

TEST(Evaluate, WithheldReportsCountInTheRankingOnly) {
  const std::vector<Report> reports = {{0, 2, shifted(0), 0.9, true},
                                       {0, 3, shifted(0), 0.1, false},
                                       {0, 5, shifted(0), 0.05, false}};
  const Evaluation result = evaluate(truth_of({{0, 2}, {0, 3}}), reports, true);
  EXPECT_EQ(result.strict.reported, 1);
  EXPECT_EQ(result.strict.good, 1);
  EXPECT_EQ(result.strict_ranked->raw_recall, 1);
}

TEST(Evaluate, TheStrictRankingHasItsOwnScoreWhereThereIsOne) {
  GroundTruth truth = truth_of({{0, 2}, {0, 3}});
  const GroundTruth all = truth_of({{0, 2}, {0, 3}, {0, 7}});
  truth.all_log = all.log;
  truth.all_information = all.information;
  std::vector<Report> reports = {{0, 7, shifted(0), 0.9, true, 0.1},
                                 {0, 2, shifted(0), 0.8, true, 0.7}};
  Evaluation result = evaluate(truth, reports, true);
  EXPECT_EQ(result.strict_ranked->recall_at_99, 0.5);
  EXPECT_EQ(result.geometric_ranked->recall_at_99, 0.5);
  reports[0].overlap_confidence.reset();
  result = evaluate(truth, reports, true);
  EXPECT_EQ(result.strict_ranked->recall_at_99, 0);  // 0.9 stands before 0.7
  EXPECT_EQ(result.strict_ranked->recall_at_50, 0.5);
}

TEST(Evaluate, GeometricRuleForgivesLowOverlapButRecallStaysWithTheListedPairs) {
  GroundTruth truth = truth_of({{0, 2}, {0, 3}});
  const GroundTruth all = truth_of({{0, 2}, {0, 3}, {0, 7}, {0, 8}});
  truth.all_log = all.log;
  truth.all_information = all.information;
  // right and listed; right with low overlap; wrong with low overlap; no overlap at all
  const std::vector<Report> reports = {
      {0, 2, shifted(0)}, {0, 7, shifted(0.1)}, {0, 8, shifted(0.3)}, {0, 9, shifted(0)}};
  const Evaluation result = evaluate(truth, reports, false);
  EXPECT_EQ(result.strict.good, 1);
  EXPECT_EQ(result.strict.reported, 4);
  ASSERT_TRUE(result.geometric.has_value());
  EXPECT_EQ(result.geometric->good, 2);
  EXPECT_EQ(result.geometric->good_recall, 1);
  EXPECT_EQ(result.geometric->ground_truth, 2);
  EXPECT_EQ(result.geometric->precision(), 0.5);
  EXPECT_EQ(result.geometric->recall(), 0.5);
}

TEST(Evaluate, RefusesTruthsWithoutTheirInformation) {
  GroundTruth truth = truth_of({{0, 2}});
  truth.information.clear();
  test::expect_error<InvalidArgument>([&] { evaluate(truth, {}, false); },
                                      {"1 transforms", "0 information"});
}

TEST(SceneMean, IsUnweighted) {
  Scores small, large;
  small.good = small.good_recall = 1;
  small.ground_truth = 2;
  small.reported = 4;
  large.good = large.good_recall = 100;
  large.ground_truth = 100;
  large.reported = 100;
  const MeanScores mean = scene_mean({small, large});
  EXPECT_DOUBLE_EQ(mean.recall, 0.75);
  EXPECT_DOUBLE_EQ(mean.precision, 0.625);
  EXPECT_EQ(scene_mean({}).recall, 0);
}

}  // namespace
}  // namespace gpureg::evaluation
