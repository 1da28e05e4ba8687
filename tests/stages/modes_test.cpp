// SPDX-License-Identifier: BSD-3-Clause
// Which modes remain between the two refinements.
#include <gtest/gtest.h>

#include <cmath>

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
  RegistrationOptions options;
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
  RegistrationOptions options;
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
