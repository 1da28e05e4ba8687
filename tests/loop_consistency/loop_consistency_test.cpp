// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/loop_consistency.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "gpureg/error.hpp"
#include "support/expect_error.hpp"

namespace gpureg {
namespace {

Eigen::Isometry3d moved(double angle, const Eigen::Vector3d& axis, const Eigen::Vector3d& shift) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
  pose.translation() = shift;
  return pose;
}

/// Clouds at known places, and pairs of them with whatever confidence.
struct Set {
  std::vector<Eigen::Isometry3d> world_from_cloud;
  std::vector<Pair> pairs;
  std::vector<RegistrationResult> results;

  explicit Set(std::uint32_t clouds) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> number(-3.0, 3.0);
    for (std::uint32_t k = 0; k < clouds; ++k)
      world_from_cloud.push_back(moved(number(random),
                                       {number(random), number(random), number(random)},
                                       {number(random), number(random), number(random)}));
  }
  Eigen::Isometry3d right(std::uint32_t source, std::uint32_t target) const {
    return world_from_cloud[target].inverse() * world_from_cloud[source];
  }
  /// `wrong` moves the target on, so that the pose misses the right one by as much.
  std::size_t add(std::uint32_t source, std::uint32_t target, double confidence,
                  const Eigen::Isometry3d& wrong = Eigen::Isometry3d::Identity()) {
    RegistrationResult result;
    result.status = RegistrationStatus::aligned;
    result.reason = RegistrationReason::none;
    result.target_from_source = wrong * right(source, target);
    result.confidence = confidence;
    RegistrationMode mode;
    mode.target_from_source = result.target_from_source;
    mode.confidence = confidence;
    result.modes.push_back(mode);
    pairs.push_back({source, target});
    results.push_back(result);
    return pairs.size() - 1;
  }
  void add_all(double confidence) {
    for (std::uint32_t i = 0; i < world_from_cloud.size(); ++i)
      for (std::uint32_t j = i + 1; j < world_from_cloud.size(); ++j) add(i, j, confidence);
  }
  std::size_t find(std::uint32_t source, std::uint32_t target) const {
    std::size_t p = 0;
    while (pairs[p].source != source || pairs[p].target != target) ++p;
    return p;
  }
  std::vector<PairConsistency> score(const LoopConsistencyOptions& options = {}) const {
    return loop_consistency(pairs, results, options);
  }
};

/// Where wrong loops seldom close, as where no place looks like another, two loops say much.
LoopConsistencyOptions without_aliases() {
  LoopConsistencyOptions options;
  options.false_closure_rate = 0.1;
  options.missed_closure_rate = 0.05;
  return options;
}

const Eigen::Isometry3d kWrong = moved(1.0, {0, 0, 1}, {1.0, 0.5, 0});

TEST(LoopConsistency, AWrongPairAmongRightOnesFalls) {
  Set set(5);
  set.add_all(0.95);
  const std::size_t wrong = set.find(1, 3);
  set.results[wrong].target_from_source = set.results[wrong].modes[0].target_from_source =
      kWrong * set.right(1, 3);
  const auto out = set.score();
  for (std::size_t p = 0; p < out.size(); ++p) {
    EXPECT_EQ(out[p].loops, 3u);
    if (p == wrong)
      EXPECT_LT(out[p].confidence, 0.5);
    else
      EXPECT_GT(out[p].confidence, 0.95) << p;
  }
}

TEST(LoopConsistency, AWeakRightPairRises) {
  Set set(4);
  set.add_all(0.95);
  const std::size_t weak = set.find(0, 2);
  set.results[weak].confidence = set.results[weak].modes[0].confidence = 0.2;
  EXPECT_GT(set.score(without_aliases())[weak].confidence, 0.8);
  EXPECT_GT(set.score()[weak].confidence, 0.5);
}

TEST(LoopConsistency, AnotherModeIsChosenWhereLoopsSupportIt) {
  Set set(4);
  set.add_all(0.95);
  const std::size_t alias = set.find(0, 3);
  RegistrationResult& r = set.results[alias];
  r.modes.push_back(r.modes[0]);
  r.modes[1].confidence = 0.1;
  r.confidence = r.modes[0].confidence = 0.5;
  r.target_from_source = r.modes[0].target_from_source = kWrong * set.right(0, 3);
  const PairConsistency out = set.score()[alias];
  EXPECT_EQ(out.mode, 1u);
  EXPECT_GT(out.confidence, 0.5);
  LoopConsistencyOptions first_only;
  first_only.modes = 1;
  EXPECT_EQ(set.score(first_only)[alias].mode, 0u);
  EXPECT_LT(set.score(first_only)[alias].confidence, 0.2);
}

TEST(LoopConsistency, LoopsThroughDoubtfulPairsCountLittle) {
  Set set(3);
  set.add(0, 1, 0.9);
  set.add(1, 2, 0.05);
  set.add(0, 2, 0.05, kWrong);
  EXPECT_NEAR(set.score()[0].confidence, 0.9, 0.01);
}

TEST(LoopConsistency, WithoutLoopsNothingChanges) {
  Set set(5);
  for (std::uint32_t k = 0; k + 1 < 5; ++k) set.add(k, k + 1, 0.1 + 0.2 * k);
  set.add(2, 2, 1.0);  // of a cloud with itself
  RegistrationResult skipped;
  set.pairs.push_back({0, 2});
  set.results.push_back(skipped);
  const auto out = set.score();
  for (std::size_t p = 0; p < out.size(); ++p) {
    EXPECT_EQ(out[p].confidence, set.results[p].confidence);
    EXPECT_EQ(out[p].loops, 0u);
    EXPECT_EQ(out[p].path, 0u);
    EXPECT_EQ(out[p].mode, 0u);
  }
  EXPECT_TRUE(loop_consistency({}, {}).empty());
}

/// A walk of ten clouds, each of which knows the next two, that passes two places that look alike:
/// what sees the first one (clouds 0 to 2) is found in the second one (7 to 9), always by the same
/// mistake.
Set walk_past_aliases(double confidence_of_aliases) {
  Set set(10);
  for (std::uint32_t k = 0; k + 1 < 10; ++k) set.add(k, k + 1, 0.9999);
  for (std::uint32_t k = 0; k + 2 < 10; ++k) set.add(k, k + 2, 0.9);
  const Eigen::Isometry3d mistake = moved(0.1, {0, 0, 1}, {4.0, 1.0, 0});  // in the world
  for (std::uint32_t i = 0; i < 3; ++i)
    for (std::uint32_t j = 7; j < 10; ++j) {
      const std::size_t p = set.add(i, j, confidence_of_aliases);
      set.results[p].target_from_source = set.results[p].modes[0].target_from_source =
          set.world_from_cloud[j].inverse() * mistake * set.world_from_cloud[i];
    }
  return set;
}

TEST(LoopConsistency, AliasesThatCloseLoopsAreRejectedByPaths) {
  const Set set = walk_past_aliases(0.95);
  const auto out = set.score();
  for (std::size_t p = 0; p < out.size(); ++p) {
    const bool alias = set.pairs[p].target >= 7 && set.pairs[p].source < 3;
    // All their loops of three close, those of right pairs too.
    EXPECT_GE(out[p].loops, 1u) << p;
    if (alias)
      EXPECT_LT(out[p].confidence, 0.5) << p;
    else
      EXPECT_GT(out[p].confidence, 0.85) << p;
  }
  // They would raise the confidence otherwise.
  Set alone = set;
  alone.pairs.erase(alone.pairs.begin() + 4);  // the way is cut: clouds 4 and 5, ...
  alone.results.erase(alone.results.begin() + 4);
  for (std::uint32_t k = 3; k < 5; ++k) {
    const std::size_t p = alone.find(k, k + 2);
    alone.pairs.erase(alone.pairs.begin() + static_cast<std::ptrdiff_t>(p));
    alone.results.erase(alone.results.begin() + static_cast<std::ptrdiff_t>(p));
  }
  EXPECT_GT(alone.score()[alone.find(0, 9)].confidence, 0.95);
}

TEST(LoopConsistency, PathsCountTheirEdges) {
  constexpr std::uint32_t kClouds = 30000;
  Set set(kClouds);
  for (std::uint32_t k = 0; k + 1 < kClouds; ++k) set.add(k, k + 1, 0.9999999);
  std::mt19937 random(11);
  for (int k = 0; k < 20000; ++k) {
    const std::uint32_t a = random() % kClouds, b = random() % kClouds;
    if (std::max(a, b) - std::min(a, b) > 1) set.add(a, b, 0.5);
  }
  const auto out = set.score();
  for (std::size_t p = 0; p < out.size(); ++p) {
    const std::uint32_t a = set.pairs[p].source, b = set.pairs[p].target;
    const std::uint32_t steps = std::max(a, b) - std::min(a, b);
    ASSERT_EQ(out[p].path, steps == 1 ? 0u : steps);
    if (steps > 1) ASSERT_GT(out[p].confidence, 0.6);  // it closes
  }
}

TEST(LoopConsistency, ThreadsDoNotMatter) {
  Set set(24);
  set.add_all(0.6);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(0, 1);
  for (RegistrationResult& result : set.results) {
    RegistrationMode other = result.modes[0];
    other.target_from_source = kWrong * other.target_from_source;
    other.confidence = 0.1 * number(random);
    result.modes.push_back(other);
    if (number(random) < 0.3)
      std::swap(result.modes[0].target_from_source, result.modes[1].target_from_source);
    result.target_from_source = result.modes[0].target_from_source;
  }
  LoopConsistencyOptions options;
  options.threads = 1;
  const auto alone = set.score(options);
  options.threads = 5;
  const auto shared = set.score(options);
  for (std::size_t p = 0; p < alone.size(); ++p) {
    EXPECT_EQ(alone[p].confidence, shared[p].confidence) << p;
    EXPECT_EQ(alone[p].mode, shared[p].mode) << p;
  }
}

TEST(LoopConsistency, OrderDoesNotMatter) {
  Set set(9);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(0.0, 1.0);
  for (std::uint32_t i = 0; i < 9; ++i)
    for (std::uint32_t j = 0; j < 9; ++j)
      if (i != j && number(random) < 0.6)
        set.add(i, j, number(random),
                number(random) < 0.3 ? kWrong : moved(0.02, {1, 1, 0}, {0.03, 0, 0}));
  const auto before = set.score();
  std::vector<std::size_t> order(set.pairs.size());
  for (std::size_t p = 0; p < order.size(); ++p) order[p] = p;
  for (int round = 0; round < 3; ++round) {
    std::shuffle(order.begin(), order.end(), random);
    Set other(9);
    for (const std::size_t p : order) {
      other.pairs.push_back(set.pairs[p]);
      other.results.push_back(set.results[p]);
    }
    const auto after = other.score();
    for (std::size_t k = 0; k < order.size(); ++k) {
      EXPECT_EQ(after[k].confidence, before[order[k]].confidence);
      EXPECT_EQ(after[k].mode, before[order[k]].mode);
      EXPECT_EQ(after[k].loops, before[order[k]].loops);
      EXPECT_EQ(after[k].path, before[order[k]].path);
    }
  }
}

TEST(LoopConsistency, ResultsWithoutModesTakePartWithTheirScore) {
  Set set(4);
  set.add_all(0.6);
  const std::size_t wrong = set.find(0, 1);
  set.results[wrong].target_from_source = kWrong * set.right(0, 1);
  for (RegistrationResult& r : set.results) r.modes.clear();
  const auto out = set.score();
  EXPECT_LT(out[wrong].confidence, 0.6);
  EXPECT_GT(out[set.find(2, 3)].confidence, 0.6);
}

TEST(LoopConsistency, ShiftsAreMeasuredAtTheClouds) {
  // All clouds lie ten kilometres from the origins of their frames: a hundredth of a degree moves
  // the origin by metres, the cloud not at all.
  const auto far_set = [](bool with_moments) {
    Set set(4);
    const Eigen::Vector3d middle(10000, 0, 0);
    for (Eigen::Isometry3d& pose : set.world_from_cloud) pose = Eigen::Isometry3d::Identity();
    const auto about_middle = [&](double angle) {
      return Eigen::Isometry3d(Eigen::Translation3d(middle) *
                               Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()) *
                               Eigen::Translation3d(-middle));
    };
    double angle = 0.002;
    for (std::uint32_t i = 0; i < 4; ++i)
      for (std::uint32_t j = i + 1; j < 4; ++j) set.add(i, j, 0.7, about_middle(angle = -angle));
    if (with_moments)
      for (RegistrationResult& r : set.results) {
        r.source_moments.count = r.target_moments.count = 1000;
        r.source_moments.sum = r.target_moments.sum = 1000.0 * middle;
      }
    return set;
  };
  for (const PairConsistency& a : far_set(true).score(without_aliases()))
    EXPECT_GT(a.confidence, 0.9);
  for (const PairConsistency& a : far_set(true).score()) EXPECT_GT(a.confidence, 0.85);
  for (const PairConsistency& a : far_set(false).score()) EXPECT_LT(a.confidence, 0.7);
}

TEST(LoopConsistency, ManyPairsStayBounded) {
  constexpr std::uint32_t kClouds = 2000, kEach = 40;
  Set set(kClouds);
  for (std::uint32_t k = 0; k < kClouds; ++k)
    for (std::uint32_t step = 1; step <= kEach; ++step) set.add(k, (k + step) % kClouds, 0.9);
  LoopConsistencyOptions few;
  few.neighbors = 8;
  for (const PairConsistency& a : set.score(few)) EXPECT_LE(a.loops, 8u);
  for (const PairConsistency& a : set.score()) EXPECT_GE(a.confidence, 0.9);
}

TEST(LoopConsistency, BadInputIsNamed) {
  Set set(3);
  set.add_all(0.9);
  const auto refused = [&](auto&& change, std::initializer_list<std::string> words) {
    Set bad = set;
    change(bad);
    test::expect_error<InvalidArgument>([&] { bad.score(); }, words);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused([](Set& s) { s.results.pop_back(); }, {"results has 2", "pairs has 3"});
  refused([&](Set& s) { s.results[1].confidence = nan; }, {"results[1].confidence", "nan"});
  refused([](Set& s) { s.results[2].confidence = 1.5; }, {"results[2].confidence", "1.5"});
  refused([](Set& s) { s.results[2].modes[0].confidence = -0.1; },
          {"results[2].modes[0].confidence", "-0.1"});
  refused([](Set& s) { s.results[0].target_from_source.matrix()(0, 0) = 7; },
          {"results[0].target_from_source"});
  refused([&](Set& s) { s.results[0].modes[0].target_from_source.matrix()(1, 3) = nan; },
          {"results[0].modes[0].target_from_source"});
}

TEST(LoopConsistency, BadOptionsAreNamed) {
  const auto refused = [](auto&& change, const std::string& field) {
    LoopConsistencyOptions options;
    change(options);
    test::expect_error<InvalidArgument>([&] { loop_consistency({}, {}, options); }, {field});
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float bad : {nan, 0.0f, -1.0f}) {
    refused([&](auto& o) { o.closing_angle = bad; }, "closing_angle");
    refused([&](auto& o) { o.closing_distance = bad; }, "closing_distance");
    refused([&](auto& o) { o.false_closure_rate = static_cast<double>(bad); },
            "false_closure_rate");
    refused([&](auto& o) { o.missed_closure_rate = static_cast<double>(bad); },
            "missed_closure_rate");
    refused([&](auto& o) { o.max_odds_factor = static_cast<double>(bad); }, "max_odds_factor");
    refused([&](auto& o) { o.voxel_size = bad; }, "voxel_size");
  }
  refused([](auto& o) { o.min_confidence = 2; }, "min_confidence");
  refused([](auto& o) { o.min_alternative_confidence = -1; }, "min_alternative_confidence");
  refused([](auto& o) { o.modes = 0; }, "modes");
  refused([](auto& o) { o.neighbors = 1; }, "neighbors");
  refused([](auto& o) { o.iterations = 0; }, "iterations");
}

}  // namespace
}  // namespace gpureg
