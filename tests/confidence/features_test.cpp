// SPDX-License-Identifier: BSD-3-Clause
// Features by name, and the regressions that the library applies to them.
#include "confidence/features.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "confidence/confidence.hpp"
#include "confidence/confidence_model.hpp"

namespace gpureg::confidence {
namespace {

double value(const Features& features, Feature feature) {
  return features[static_cast<std::size_t>(feature)];
}

/// Of a pose in a furnished room.
PoseEvidence some_evidence() {
  PoseEvidence e;
  e.match_inliers = 60;
  e.match_support = 0.02;
  e.source_overlap = 0.5, e.target_overlap = 0.4;
  e.source_overlap_any_normal = 0.55, e.target_overlap_any_normal = 0.45;
  e.source_normal_weighted_overlap = 0.4, e.target_normal_weighted_overlap = 0.3;
  e.source_observed = 0.6, e.target_observed = 0.5;
  e.source_free_space_violation = 0.01, e.target_free_space_violation = 0.02;
  e.source_occluded = 0.1, e.target_occluded = 0.2;
  e.source_near_surface = 0.7, e.target_near_surface = 0.6;
  e.source_front_violation_near = 0.004, e.target_front_violation_near = 0.003;
  e.source_front_violation_far = 0.02, e.target_front_violation_far = 0.01;
  e.source_behind_surface = 0.05, e.target_behind_surface = 0.06;
  e.information_eigenvalues = {1, 2, 3, 4, 5, 6};
  return e;
}

TEST(Features, NamesAreUnique) {
  std::set<std::string> names;
  for (std::size_t k = 0; k < kFeatureCount; ++k) names.insert(to_string(static_cast<Feature>(k)));
  EXPECT_EQ(names.size(), kFeatureCount);
  EXPECT_STREQ(to_string(Feature::log_match_support), "log_match_support");
  EXPECT_STREQ(to_string(Feature::distinct_share), "distinct_share");
}

TEST(Features, OnlyOfAvailableEvidence) {
  const Features all = features_of(some_evidence(), {true, true}, Regressand::ranking),
                 sides = features_of(some_evidence(), {false, true}, Regressand::ranking),
                 none = features_of(some_evidence(), {false, false}, Regressand::ranking);
  EXPECT_EQ(value(all, Feature::higher_observed), 0.6);
  EXPECT_GT(value(all, Feature::higher_front_share), 0.0);
  EXPECT_EQ(value(sides, Feature::higher_observed), 0.0);
  EXPECT_GT(value(sides, Feature::higher_front_share), 0.0);
  EXPECT_EQ(value(none, Feature::higher_near_surface), 0.0);
  EXPECT_EQ(value(none, Feature::log_lower_overlap), std::log(0.4));
}

// Of a scan on a model tell containment, what the scan saw through, and the rank.
TEST(Features, ContainmentInModels) {
  const Features x = features_of(some_evidence(), {true, true, true}, Regressand::confidence);
  EXPECT_EQ(value(x, Feature::log_uncovered), std::log(1 - 0.55));
  EXPECT_EQ(value(x, Feature::log_higher_violation), std::log(0.02));
  EXPECT_EQ(value(x, Feature::log_higher_weighted_overlap), std::log(0.4));
  EXPECT_EQ(std::count(x.begin(), x.end(), 0.0), static_cast<std::ptrdiff_t>(kFeatureCount - 3));
  PoseEvidence clean = some_evidence();  // how clean a scan is tells nothing
  clean.source_normal_weighted_overlap = 0.8;
  EXPECT_EQ(features_of(clean, {true, true, true}, Regressand::confidence), x);
  const Features rank = features_of(some_evidence(), {true, true, true}, Regressand::ranking);
  EXPECT_EQ(value(rank, Feature::log_higher_weighted_overlap), std::log(0.4));
  EXPECT_EQ(std::count(rank.begin(), rank.end(), 0.0),
            static_cast<std::ptrdiff_t>(kFeatureCount - 2));
  const std::vector<PoseEvidence> modes{some_evidence()};
  using V = ViewpointSource;
  EXPECT_TRUE(available_evidence(modes, V::model, V::given).model);
  EXPECT_TRUE(available_evidence(modes, V::none, V::model).model);
  EXPECT_FALSE(available_evidence(modes, V::normals, V::given).model);
}

// Where free space is known, small front violations rank modes and leave the confidence alone.
TEST(Features, SmallFrontViolationsOnlyRank) {
  const auto near_of = [](AvailableEvidence available, Regressand regressand) {
    return value(features_of(some_evidence(), available, regressand),
                 Feature::log_front_violation_near);
  };
  EXPECT_NEAR(near_of({true, true}, Regressand::ranking), std::log(0.007), 1e-12);
  EXPECT_NEAR(near_of({true, true}, Regressand::confidence), std::log(0.02), 1e-12);
  EXPECT_NEAR(near_of({false, true}, Regressand::confidence), std::log(0.007), 1e-12);
}

Features matched(double inliers) {
  PoseEvidence e = some_evidence();
  e.match_inliers = static_cast<std::uint32_t>(inliers);
  return features_of(e, {true, true}, Regressand::confidence);
}

TEST(Features, RankAmongTheModes) {
  Features features{};
  const std::vector<Features> own{matched(60), matched(100), matched(20)};
  add_rank({3, 20, -1}, own, 1, 12, features);
  EXPECT_EQ(value(features, Feature::log_odds), 14) << "bounded";
  EXPECT_EQ(value(features, Feature::margin), 11);
  EXPECT_EQ(value(features, Feature::distinct_share), 0.25);
  EXPECT_NEAR(value(features, Feature::share), std::log(1e4), 1e-9) << "bounded";
  EXPECT_NEAR(value(features, Feature::rival_match_inliers), std::log(60), 1e-9);
  EXPECT_NEAR(value(features, Feature::third_match_inliers), std::log(20), 1e-9);
  EXPECT_NEAR(value(features, Feature::match_inliers_lead), std::log(100.0 / 60), 1e-9);
  EXPECT_EQ(value(features, Feature::match_support_lead), 0);
  add_rank({3, 20, -1}, own, 2, 12, features);
  EXPECT_EQ(value(features, Feature::margin), -15);
  EXPECT_LT(value(features, Feature::match_inliers_lead), 0);
  add_rank({1, 0.5, -1}, own, 0, 12, features);
  const double others = std::exp(-0.5) + std::exp(-2);
  EXPECT_NEAR(value(features, Feature::share), std::log(1 / others), 1e-12);
  add_rank({3}, {own[0]}, 0, 12, features);
  EXPECT_EQ(value(features, Feature::margin), 17) << "no other mode";
  EXPECT_EQ(value(features, Feature::rival_match_inliers), 0);
}

// More overlap never hurts, more violation never helps, and outside of the values of the fit
// nothing gets more certain.
TEST(Confidence, IsMonotoneInEachFeature) {
  const std::set<Feature> better{Feature::log_match_support,
                                 Feature::log_match_inliers,
                                 Feature::log_lower_weighted_overlap,
                                 Feature::log_lower_overlap,
                                 Feature::log_first_eigenvalue,
                                 Feature::log_second_eigenvalue,
                                 Feature::log_third_eigenvalue,
                                 Feature::information_volume,
                                 Feature::lower_normal_agreement,
                                 Feature::higher_normal_agreement,
                                 Feature::share,
                                 Feature::match_inliers_lead,
                                 Feature::match_support_lead,
                                 Feature::weighted_overlap_lead};
  for (const ConfidenceModel* model : {&kFreeSpaceAndSurfaceSides, &kSurfaceSides, &kFreeSpace})
    for (const Regression* regression : {&model->confidence, &model->overlap}) {
      ASSERT_GT(regression->step_count, 10u);
      EXPECT_EQ(regression->weights, Features{});
      for (std::size_t k = 0; k < regression->step_count; ++k) {
        const Step& step = regression->steps[k];
        EXPECT_LT(step.from, step.to);
        EXPECT_EQ(step.rise > 0, better.count(step.feature) > 0) << to_string(step.feature);
      }
      Features far{}, farther{};
      for (std::size_t k = 0; k < kFeatureCount; ++k) far[k] = 1e6, farther[k] = 1e9;
      EXPECT_EQ(regression->log_odds(far), regression->log_odds(farther));
    }
}

// The library applies the numbers of confidence_model.hpp.
TEST(Confidence, OfTheGeneratedModel) {
  struct Kind {
    AvailableEvidence available;
    const ConfidenceModel& model;
  };
  const Kind kinds[] = {{{true, true}, kFreeSpaceAndSurfaceSides},
                        {{false, true}, kSurfaceSides},
                        {{true, false}, kFreeSpace},
                        {{false, false}, kOverlapAlone},
                        {{true, true, true}, kModel},
                        {{false, true, true}, kModel}};
  const PoseEvidence better = some_evidence();
  PoseEvidence worse = better;
  worse.match_inliers = 5;
  worse.source_front_violation_near = 0.1;
  worse.source_normal_weighted_overlap = 0.3;
  worse.source_overlap_any_normal = 0.5;
  constexpr std::uint32_t kRefined = 16;
  const OverlapCount overlap{90, 2000};
  const auto probability = [](double odds) { return 1 / (1 + std::exp(-odds)); };
  for (const auto& [available, model] : kinds) {
    const std::vector<double> log_odds = rank_modes({better, worse}, available);
    ASSERT_EQ(log_odds.size(), 2u);
    EXPECT_EQ(log_odds[0],
              model.ranking.log_odds(features_of(better, available, Regressand::ranking)));
    ASSERT_GT(log_odds[0], log_odds[1]);
    Features x = features_of(better, available, Regressand::confidence);
    add_rank(log_odds, {x, features_of(worse, available, Regressand::confidence)}, 0, kRefined, x);
    const double share = probability(log_odds[0] - log_odds[1]);
    const double want =
        std::min(probability(model.confidence.log_odds(x)), share) * factor_of(overlap);
    const std::vector<ModeConfidence> found = confidences_of(
        {{better, log_odds[0], overlap}, {worse, log_odds[1], overlap}}, available, kRefined);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_NEAR(found[0].confidence, want, 1e-12);
    EXPECT_NEAR(found[0].overlap_confidence, std::min(want, probability(model.overlap.log_odds(x))),
                1e-12);
    EXPECT_LE(found[1].confidence, found[0].confidence);
  }
}

TEST(Confidence, FewOverlappingPoints) {
  EXPECT_LT(factor_of({20, 1000}), 0.1);
  EXPECT_GT(factor_of({200, 1000}), 0.99);
  EXPECT_GT(factor_of({60, 6000}), factor_of({60, 1000}));
}

}  // namespace
}  // namespace gpureg::confidence
