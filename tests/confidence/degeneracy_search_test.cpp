// SPDX-License-Identifier: BSD-3-Clause
// Where refinement may stop anywhere along a wall, the most likely pose is perturbed along it, and
// the evidence tells which pose is correct.
#include "confidence/degeneracy_search.hpp"
#include "api/with_settings.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "confidence/confidence.hpp"
#include "confidence/pose_evidence.hpp"
#include "gpureg/registration.hpp"
#include "support/prepared.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

/// A floor and a wall along x.
std::vector<Vec3> bare_corner(std::mt19937& random, int count) {
  std::uniform_real_distribution<float> unit;
  std::vector<Vec3> out;
  for (int k = 0; k < count; ++k) {
    const float a = 3 * unit(random) - 1.5f, b = 1.5f * unit(random);
    out.push_back(k % 2 == 0 ? Vec3{a, b, 0} : Vec3{a, 0, b});
  }
  return out;
}

constexpr std::uint32_t kAllMatches = 1u << 20;

/// Gives the only mode so many matches that its evidence has these odds.
void match(PairOutcome& outcome, const PreparedState& source, const PreparedState& target,
           double log_odds) {
  ModeOutcome& mode = outcome.modes.at(0);
  const auto odds = [&](std::uint32_t inliers) {
    mode.matches.inliers = inliers;
    outcome.match_weight_source = outcome.match_weight_target = kAllMatches;
    mode.matches.source_weight = mode.matches.target_weight = std::min(inliers, kAllMatches);
    const std::vector<PoseEvidence> evidence{confidence::evidence_of(
        outcome, mode, confidence::spectra_of({&mode}, source, target).front(), source, target,
        false)};
    return confidence::rank_modes(evidence,
                                  confidence::available_evidence(evidence, ViewpointSource::given,
                                                                 ViewpointSource::given))
        .front();
  };
  std::uint32_t inliers = 0;
  for (std::uint32_t bit = 1u << 31; bit > 0; bit /= 2)
    if (odds(inliers + bit) < log_odds) inliers += bit;
  EXPECT_NEAR(odds(inliers), log_odds, 0.5);
}

PosesOfPair perturbed(const PreparedState& source, const PreparedState& target,
                      const PairOutcome& outcome, const RegistrationSettings& options) {
  const PairInput pair{&source, &target, {}, {}, {}};
  return confidence::search_degeneracies({&pair, 1}, {&outcome, 1}, options, 1).at(0);
}

TEST(DegeneracySearch, BothWaysAlongTheWall) {
  std::mt19937 random(3);
  cpu::Exec exec(1);
  const std::vector<Vec3> a = bare_corner(random, 40000), b = bare_corner(random, 40000);
  const auto source = test::prepare_one(exec, test::raw_cloud(a), {}),
             target = test::prepare_one(exec, test::raw_cloud(b), {});
  PairOutcome outcome = test::verified_in_place(exec, *source, *target);
  match(outcome, *source, *target, 0);
  RegistrationSettings options;
  for (const float distance : {0.4f, 0.15f}) {
    options.evidence.degeneracy_search_distance = distance;
    const PosesOfPair found = perturbed(*source, *target, outcome, options);
    ASSERT_EQ(found.poses.size(), 8u);
    EXPECT_EQ(found.origin_mode, 0u);
    double sum = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      const Pose<double>&pose = found.poses[k], &from = outcome.modes[0].pose;
      EXPECT_NEAR(std::abs(pose.tx - from.tx),
                  static_cast<double>(distance) * (1 - 0.25 * static_cast<double>(k / 2)), 0.02);
      EXPECT_NEAR(pose.ty, from.ty, 0.02);
      EXPECT_NEAR(pose.tz, from.tz, 0.02);
      EXPECT_GT(std::abs(pose.w), 0.999);
      sum += pose.tx - from.tx;
    }
    EXPECT_NEAR(sum, 0, 1e-3) << "one each way";
  }
  options.evidence.degeneracy_search_distance = 0;
  EXPECT_TRUE(perturbed(*source, *target, outcome, options).poses.empty());
  options.evidence.degeneracy_search_distance = 0.4f;
  EXPECT_TRUE(perturbed(*source, *target, PairOutcome{}, options).poses.empty());
}

// Undecided modes are perturbed by all steps, confident ones by two poses, modes with log odds
// below -5 not at all.
TEST(DegeneracySearch, MorePosesWhereTheEvidenceIsOpen) {
  std::mt19937 random(3);
  cpu::Exec exec(1);
  const std::vector<Vec3> points = bare_corner(random, 40000);
  const auto cloud = test::prepare_one(exec, test::raw_cloud(points), {});
  PairOutcome outcome = test::verified_in_place(exec, *cloud, *cloud);
  const auto poses_at = [&](double log_odds) {
    match(outcome, *cloud, *cloud, log_odds);
    return perturbed(*cloud, *cloud, outcome, RegistrationSettings()).poses.size();
  };
  EXPECT_EQ(poses_at(-5.3), 0u);
  EXPECT_EQ(poses_at(-2), 8u);
  EXPECT_EQ(poses_at(1), 8u);
  EXPECT_EQ(poses_at(5), 2u);
}

// The log odds of a scan on its model do not tell poses that are a few voxels apart.
TEST(DegeneracySearch, AllPosesOnAModel) {
  std::mt19937 random(3);
  cpu::Exec exec(1);
  const auto cloud = test::prepare_one(exec, test::raw_cloud(bare_corner(random, 40000)), {});
  const PairOutcome outcome = test::verified_in_place(exec, *cloud, *cloud);
  cloud->statistics.viewpoint = ViewpointSource::model;
  EXPECT_EQ(perturbed(*cloud, *cloud, outcome, RegistrationSettings()).poses.size(), 8u);
}

TEST(DegeneracySearch, RotatesAboutTheCentreOfTheInliers) {
  std::mt19937 random(5);
  cpu::Exec exec(1);
  // A ball, far from both origins: nothing holds its turning, everything its place.
  std::normal_distribution<float> normal;
  std::vector<Vec3> ball;
  for (int k = 0; k < 20000; ++k) {
    const Eigen::Vector3f d =
        Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized() * 0.5f;
    ball.push_back({d.x() + 6, d.y() - 3, d.z() + 1});
  }
  ball.push_back({0, 0, 0});
  const auto cloud = test::prepare_one(exec, test::raw_cloud(ball), {});
  PairOutcome outcome = test::verified_in_place(exec, *cloud, *cloud);
  match(outcome, *cloud, *cloud, 0);
  RegistrationSettings options;
  const PosesOfPair found = perturbed(*cloud, *cloud, outcome, options);
  ASSERT_EQ(found.poses.size(), 8u);
  const Vec3 middle{6 - cloud->origin[0], -3 - cloud->origin[1], 1 - cloud->origin[2]};
  for (const Pose<double>& pose : found.poses) {
    EXPECT_LT(norm(apply(to_rigid(pose), middle) - middle), 0.05f);
    EXPECT_LT(std::abs(pose.w), 0.9988) << "0.1 of a metre at a metre, or up to four times that";
  }
}

// Where the geometry holds the pose in every direction, a perturbed one comes back, less well
// refined: it must not replace its origin.
TEST(DegeneracySearch, APoseThatComesBackDoesNotCount) {
  std::normal_distribution<float> noise(0, 0.005f);
  for (const unsigned seed : {9u, 10u, 11u, 12u}) {
    std::mt19937 random(seed);
    const auto room = test::scan_room(random);
    const Eigen::Isometry3d truth = test::random_pose(random);
    auto scanned = test::moved(truth.inverse(), room);
    for (Eigen::Vector3f& p : scanned)
      p += Eigen::Vector3f(noise(random), noise(random), noise(random));
    const Eigen::Vector3f eye = test::kRoomSensor,
                          moved_eye = (truth.inverse() * eye.cast<double>()).cast<float>();
    PointCloudView source(scanned), target(room);
    source.viewpoints = moved_eye.data();
    target.viewpoints = eye.data();
    source.viewpoint_count = target.viewpoint_count = 1;
    RegistrationSettings searched, still;
    still.evidence.degeneracy_search_distance = 0;
    const RegistrationResult a = align(Context::cpu(), source, target, searched),
                             b = align(Context::cpu(), source, target, still);
    ASSERT_TRUE(a.aligned());
    EXPECT_LT((a.target_from_source.matrix() - truth.matrix()).norm(), 0.02);
    EXPECT_EQ(a.target_from_source.matrix(), b.target_from_source.matrix());
    EXPECT_EQ(a.modes.size(), b.modes.size());
  }
}

// Along a bare wall a perturbed pose stays away. Both cannot be correct, so it is an alternative
// and lowers the confidence of the other.
TEST(DegeneracySearch, APoseThatStaysAwayIsAnAlternative) {
  std::mt19937 random(3);
  std::vector<Eigen::Vector3f> points;
  for (const Vec3& p : bare_corner(random, 40000)) points.emplace_back(p.x, p.y, p.z);
  PointCloudView cloud(points);
  const float eye[3] = {0, 0, 0};
  cloud.viewpoints = eye;
  cloud.viewpoint_count = 1;
  RegistrationSettings searched, still;
  still.evidence.degeneracy_search_distance = 0;
  const RegistrationResult a = align(Context::cpu(), cloud, cloud, searched),
                           b = align(Context::cpu(), cloud, cloud, still);
  ASSERT_FALSE(a.modes.empty());
  ASSERT_FALSE(b.modes.empty());
  const auto alternatives = [&](const RegistrationResult& result) {
    return std::count_if(
        result.modes.begin() + 1, result.modes.end(), [&](const RegistrationMode& mode) {
          const Eigen::Isometry3d between = Eigen::Isometry3d(result.target_from_source).inverse() *
                                            Eigen::Isometry3d(mode.target_from_source);
          const double along = std::abs(between.translation().x()),
                       across = between.translation().tail<2>().norm();
          return along > 0.25 && along < 0.9 && across < 0.1 &&
                 Eigen::AngleAxisd(between.linear()).angle() < 0.1;
        });
  };
  EXPECT_GE(alternatives(a), 1);
  EXPECT_GT(alternatives(a), alternatives(b));
  EXPECT_LE(a.confidence, b.confidence);
}

}  // namespace
}  // namespace gpureg
