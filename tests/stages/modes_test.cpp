// SPDX-License-Identifier: BSD-3-Clause
// Which candidates become modes, and which modes remain between and after the refinements.
#include <gtest/gtest.h>

#include <cmath>

#include "api/with_settings.hpp"
#include "confidence/degeneracy_search.hpp"
#include "support/prepared.hpp"
#include "support/random_clouds.hpp"

namespace gpureg::cpu {
namespace {

/// Turned about z, then shifted along x.
Mode mode_at(double degrees, double shift, std::uint32_t seed) {
  const double half = degrees * 3.14159265358979323846 / 360;
  return {{std::cos(half), 0, 0, std::sin(half), shift, 0, 0}, seed, 0};
}

std::vector<std::uint32_t> seeds_of(const std::vector<Mode>& modes) {
  std::vector<std::uint32_t> out;
  for (const Mode& mode : modes) out.push_back(mode.seed);
  return out;
}

TEST(MergeModes, WithinAShareOfTheLimits) {
  Exec exec(1);
  RegistrationSettings options;
  options.evidence.mode_angle = 10;
  options.evidence.mode_distance = 0.4f;
  const std::vector<Mode> all{mode_at(0, 0, 0),    mode_at(0, 0.19, 1), mode_at(4.9, 0, 2),
                              mode_at(0, 0.21, 3), mode_at(5.1, 0, 4),  mode_at(0, 0.6, 5)};
  for (const auto& [share, kept] :
       {std::pair<float, std::vector<std::uint32_t>>{0.5f, {0, 3, 4, 5}}, {1.0f, {0, 5}}}) {
    std::vector<std::vector<Mode>> modes{all, {}};
    merge_modes(exec, modes, options, share);
    EXPECT_EQ(seeds_of(modes[0]), kept) << share;
    EXPECT_TRUE(modes[1].empty());
  }
}

/// Candidates that are half a metre apart, with these scores, as their own seeds.
std::vector<Candidates> candidates_with(const std::vector<float>& scores) {
  Candidates out;
  for (const float score : scores) {
    const auto k = static_cast<std::uint32_t>(out.seed.size());
    out.pose.push_back(narrow(mode_at(0, 0.5 * k, k).pose));
    out.seed.push_back(k);
    out.matches.push_back({0, 0, 0});
    out.coarse_score.push_back(score);
  }
  return {out};
}

TEST(SelectModes, WeakOnesOnlyAmongTheFirst) {
  Exec exec(1);
  ModeSelection selection{mode_limits(10, 0.4f, 1.0f), 4, 2, 0.02f, 0.5f};
  const auto selected = [&](const std::vector<float>& scores) {
    return seeds_of(select_modes(exec, candidates_with(scores), selection)[0]);
  };
  using Seeds = std::vector<std::uint32_t>;
  EXPECT_EQ(selected({0.1f, 0.4f, 0.3f, 0.2f, 0.19f}), (Seeds{1, 2, 3})) << "half of the best";
  EXPECT_EQ(selected({0.01f, 0.019f, 0.02f, 0.03f}), (Seeds{3, 2})) << "the least score";
  EXPECT_EQ(selected({0.01f, 0.0f, 0.005f}), (Seeds{0, 2})) << "the first need no score";
  EXPECT_EQ(selected({1, 1, 1, 1, 1, 1}), (Seeds{0, 1, 2, 3})) << "no more than the most";
  selection.within = mode_limits(10, 0.6f, 1.0f);
  EXPECT_EQ(selected({1, 0.9f, 0.8f, 0.7f}), (Seeds{0, 2})) << "distinct ones";
}

TEST(CandidatesFromModes, KeepPoseAndSeedAndCountTheMatches) {
  Exec exec(1);
  RegistrationSettings options;
  options.compatibility.consensus_distance = 0.1f;
  MatchSet matches;
  for (int k = 0; k < 3; ++k) {
    matches.source.push_back(0);
    matches.target.push_back(0);
    for (auto* column : {&matches.px, &matches.py, &matches.pz, &matches.qy, &matches.qz})
      column->push_back(0);
    matches.qx.push_back(static_cast<float>(k));  // moved by 0, 1 and 2 metres along x
    matches.source_weight.push_back(10u + static_cast<std::uint32_t>(k));
    matches.target_weight.push_back(20u);
  }
  const auto all =
      candidates_from_modes(exec, {matches}, {{mode_at(0, 2, 7), mode_at(0, 5, 8)}}, options);
  ASSERT_EQ(all[0].pose.size(), 2u);
  EXPECT_EQ(all[0].seed, (std::vector<std::uint32_t>{7, 8}));
  EXPECT_EQ(all[0].pose[0].tx, 2);
  EXPECT_EQ(all[0].matches[0].inliers, 1u);
  EXPECT_EQ(all[0].matches[0].source_weight, 12u);
  EXPECT_EQ(all[0].matches[1].inliers, 0u);
}

TEST(DropReturned, NearTheOriginOrAnEarlierPose) {
  Exec exec(1);
  PosesOfPair perturbations;
  perturbations.returned.origin = mode_at(0, 0, 0).pose;
  // Points two metres from the axis: a degree moves them by 3.5 cm.
  perturbations.returned.outer[0] = perturbations.returned.outer[3] = 2;
  perturbations.returned.squared_distance = 0.03 * 0.03;
  const std::vector<Mode> all{mode_at(0, 0.02, 0), mode_at(1, 0, 1),   mode_at(0, 0.05, 2),
                              mode_at(0, 0.07, 3), mode_at(0.5, 0, 4), mode_at(0, 0.09, 5)};
  std::vector<std::vector<Mode>> modes{all, all, {}};
  PosesOfPair nothing = perturbations;
  nothing.returned.squared_distance = -1;
  drop_returned(exec, modes, {perturbations, nothing, perturbations});
  EXPECT_EQ(seeds_of(modes[0]), (std::vector<std::uint32_t>{1, 2, 5}));
  EXPECT_EQ(modes[1].size(), all.size()) << "a mode without correspondences has no such test";
  EXPECT_TRUE(modes[2].empty());
}

// The test of the degeneracy search against the displacement of every single point.
TEST(DropReturned, DisplacementOfThePointsInCorrespondences) {
  std::mt19937 random(7);
  Exec exec(1);
  std::vector<Vec3> sheet = test::bumpy_sheet(random, 6000, 2.0f);
  for (Vec3& p : sheet) p = p + Vec3{5, -1, 2};
  const auto cloud = test::prepare_one(exec, test::raw_cloud(sheet), {});
  const PairOutcome outcome = test::verified_in_place(exec, *cloud, *cloud);
  const PairInput pair{cloud.get(), cloud.get(), {}, {}, {}};
  RegistrationSettings options;
  const ReturnTest test =
      confidence::search_degeneracies({&pair, 1}, {&outcome, 1}, options, 1).at(0).returned;
  const double limit = static_cast<double>(kReturned * options.prepare.max_correspondence_distance);
  EXPECT_NEAR(test.squared_distance, limit * limit, 1e-9);
  const Pose<double> moved = mode_at(3, 0.1, 0).pose;
  double sum = 0;
  for (const Vec3& p : cloud->points) {
    const Vec3 d = apply(to_rigid(moved), p) - apply(to_rigid(test.origin), p);
    sum += static_cast<double>(squared_norm(d));
  }
  const double mean = sum / static_cast<double>(cloud->size);
  EXPECT_NEAR(squared_displacement(moved, test.origin, test), mean, 1e-5 * mean);
}

}  // namespace
}  // namespace gpureg::cpu
