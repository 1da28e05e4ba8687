// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/prior.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "gpureg/error.hpp"
#include "gpureg/registration.hpp"
#include "support/expect_error.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using Points = std::vector<Eigen::Vector3f>;

/// A bare room whose edges are 3 m long, about its centre: 24 poses are as good as the truth.
Points cube(std::mt19937& random, int count) {
  std::uniform_real_distribution<float> unit;
  std::normal_distribution<float> noise(0, 0.002f);
  Points out;
  for (int k = 0; k < count; ++k) {
    const int face = std::min(5, static_cast<int>(6 * unit(random)));
    Eigen::Vector3f p(unit(random), unit(random), face % 2 == 0 ? 0.0f : 1.0f);
    std::rotate(p.data(), p.data() + face / 2, p.data() + 3);
    out.push_back(Eigen::Vector3f(3 * (p.array() - 0.5f)) +
                  Eigen::Vector3f(noise(random), noise(random), noise(random)));
  }
  return out;
}

/// Two scans of something, one of them moved: the source has fewer points where swapped is false.
struct Scene {
  Context context = Context::cpu();
  RegistrationOptions options{0.1f};
  Eigen::Isometry3d truth;  ///< target from source
  PreparedCloud source, target;

  Scene(const Points& scanned, const Points& still, const Eigen::Isometry3d& pose)
      : truth(pose),
        source(prepared(test::moved(pose.inverse(), scanned),
                        (pose.inverse() * Eigen::Vector3d::Zero()).cast<float>())),
        target(prepared(still, Eigen::Vector3f::Zero())) {}

  PreparedCloud prepared(const Points& points, const Eigen::Vector3f& eye) const {
    PointCloudView view(points);
    view.viewpoints = eye.data();
    view.viewpoint_count = 1;
    return prepare(context, view, options);
  }
  RegistrationResult align(const RegistrationPrior& prior) const {
    return gpureg::align(context, source, target, options, prior);
  }
  RegistrationPrior about_truth(double degrees, double metres) const {
    PosePrior pose;
    pose.target_from_source = truth;
    pose.max_rotation = degrees;
    pose.max_translation = metres;
    RegistrationPrior prior;
    prior.pose = pose;
    return prior;
  }
};

Points without(Points points, const std::function<bool(const Eigen::Vector3f&)>& cut) {
  points.erase(std::remove_if(points.begin(), points.end(), cut), points.end());
  return points;
}

Scene cube_scene(bool swapped) {
  std::mt19937 random(11);
  // The middle of each face is missing in one: the smaller cloud is moved inside.
  const auto hole = [](const Eigen::Vector3f& p) { return p.norm() < 1.9f; };
  const Points whole = cube(random, 40000), holes = without(cube(random, 40000), hole);
  return {swapped ? whole : holes, swapped ? holes : whole, test::random_pose(random)};
}

TEST(Prior, ACubeRoomIsTurnedAsItIsKnownToBe) {
  for (const bool swapped : {false, true}) {
    const Scene scene = cube_scene(swapped);
    const RegistrationResult free = scene.align({});
    ASSERT_EQ(free.statistics.swapped, swapped);
    EXPECT_LT(free.confidence, 0.4);
    const RegistrationResult r = scene.align(scene.about_truth(40, 0.5));
    ASSERT_TRUE(r.has_pose()) << to_string(r.reason);
    EXPECT_LT(test::rotation_error_degrees(scene.truth, r.target_from_source), 1);
    EXPECT_LT(test::translation_error(scene.truth, r.target_from_source), 0.05);
    EXPECT_GT(r.confidence, free.confidence);
    for (const RegistrationMode& mode : r.modes)
      EXPECT_LT(
          test::rotation_error_degrees(scene.truth, Eigen::Isometry3d(mode.target_from_source)),
          40.01);
  }
}

TEST(Prior, GravityLeavesTheTurnsAboutTheVertical) {
  for (const bool swapped : {false, true}) {
    const Scene scene = cube_scene(swapped);
    RegistrationPrior prior;
    prior.gravity = GravityPrior{};
    prior.gravity->target_up = {0, 0, 2};
    prior.gravity->source_up = scene.truth.linear().transpose() * Eigen::Vector3d(0, 0, 1);
    const RegistrationResult r = scene.align(prior);
    ASSERT_FALSE(r.modes.empty());
    EXPECT_LE(r.modes.size(), 12u);
    for (const RegistrationMode& mode : r.modes) {
      const Eigen::Vector3d up = mode.target_from_source.linear() * prior.gravity->source_up;
      EXPECT_GT(up.z(), std::cos(10.01 * M_PI / 180));
    }
  }
}

TEST(Prior, ContradictionsAreAReason) {
  std::mt19937 random(3);
  const Points room = test::scan_room(random), again = test::scan_room(random);
  const Scene scene(again, room, test::random_pose(random));
  RegistrationPrior shifted = scene.about_truth(20, 0.5);
  shifted.pose->target_from_source.translation() += Eigen::Vector3d(0, 0, 9);
  RegistrationPrior upside_down;
  upside_down.gravity = GravityPrior{};
  upside_down.gravity->source_up = scene.truth.linear().transpose() * Eigen::Vector3d(0, 0, -1);
  upside_down.gravity->max_angle = 1e-3;
  for (const RegistrationPrior& prior : {shifted, upside_down}) {
    const RegistrationResult r = scene.align(prior);
    EXPECT_EQ(r.status, RegistrationStatus::not_aligned);
    EXPECT_EQ(r.reason, RegistrationReason::contradicts_prior) << to_string(r.reason);
    EXPECT_FALSE(r.has_pose());
    EXPECT_TRUE(r.modes.empty());
    EXPECT_EQ(r.confidence, 0);
  }
}

TEST(Prior, EmptyPriorsChangeNoBit) {
  std::mt19937 random(3);
  const Points room = test::scan_room(random), again = test::scan_room(random);
  const Scene scene(again, room, test::random_pose(random));
  const auto plain = test::bytes(align(scene.context, scene.source, scene.target, scene.options));
  EXPECT_EQ(test::bytes(scene.align({})), plain);
  RegistrationPrior wide = scene.about_truth(180, 1e6);
  wide.gravity = GravityPrior{};
  wide.gravity->max_angle = 180;
  EXPECT_EQ(test::bytes(scene.align(wide)), plain);
  // Beside others, a pair's prior is its own.
  const auto batch = align_batch(
      scene.context, {scene.source, scene.target}, {{0, 1}, {0, 1}, {1, 0}}, scene.options, {},
      {RegistrationPrior{}, scene.about_truth(5, 0.2), RegistrationPrior{}});
  EXPECT_EQ(test::bytes(batch[0]), plain);
  EXPECT_EQ(test::bytes(batch[1]), test::bytes(scene.align(scene.about_truth(5, 0.2))));
}

TEST(Prior, HoldsInTheFramesOfTheClouds) {
  // Far from both origins, the middle of the source is where shifts count.
  std::mt19937 random(3);
  Points room = test::scan_room(random), again = test::scan_room(random);
  for (Points* points : {&room, &again})
    for (Eigen::Vector3f& p : *points) p += Eigen::Vector3f(500, -300, 40);
  const Scene scene(again, room, test::random_pose(random));
  const RegistrationResult r = scene.align(scene.about_truth(10, 0.1));
  ASSERT_TRUE(r.aligned()) << to_string(r.reason);
  EXPECT_EQ(r.modes.size(), 1u);
  // A degree about the middle of the cloud moves the frame's origin by ten metres.
  const Eigen::Vector3d middle = scene.truth.inverse() * Eigen::Vector3d(502, -298.5, 41.2);
  RegistrationPrior turned = scene.about_truth(10, 0.3);
  turned.pose->target_from_source = scene.truth * Eigen::Translation3d(middle) *
                                    Eigen::AngleAxisd(M_PI / 180, Eigen::Vector3d::UnitX()) *
                                    Eigen::Translation3d(-middle);
  EXPECT_TRUE(scene.align(turned).aligned());
}

TEST(Prior, BadInputIsNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](auto&& change, std::initializer_list<std::string> words) {
    RegistrationPrior prior;
    prior.gravity = GravityPrior{};
    prior.pose = PosePrior{};
    change(prior);
    test::expect_error<InvalidArgument>([&] { prior.validate(); }, words);
  };
  refused([](auto& p) { p.gravity->source_up.setZero(); }, {"prior.gravity.source_up"});
  refused([&](auto& p) { p.gravity->target_up.x() = nan; }, {"prior.gravity.target_up"});
  refused([&](auto& p) { p.pose->target_from_source.matrix()(0, 3) = nan; },
          {"prior.pose.target_from_source"});
  refused([](auto& p) { p.pose->target_from_source.matrix()(0, 0) = 3; },
          {"prior.pose.target_from_source"});
  for (const double bad : {nan, 0.0, -1.0, 181.0}) {
    refused([&](auto& p) { p.gravity->max_angle = bad; }, {"prior.gravity.max_angle"});
    refused([&](auto& p) { p.pose->max_rotation = bad; }, {"prior.pose.max_rotation"});
    if (bad != 181.0)
      refused([&](auto& p) { p.pose->max_translation = bad; }, {"prior.pose.max_translation"});
  }
  std::mt19937 random(3);
  const Points room = test::scan_room(random);
  const Scene scene(room, room, Eigen::Isometry3d::Identity());
  const std::vector<PreparedCloud> clouds = {scene.source, scene.target};
  test::expect_error<InvalidArgument>(
      [&] {
        align_batch(scene.context, clouds, {{0, 1}}, RegistrationOptions{}, {},
                    {RegistrationPrior{}, RegistrationPrior{}});
      },
      {"priors has 2", "pairs has 1"});
  RegistrationPrior bad = scene.about_truth(10, 1);
  bad.pose->max_rotation = 0;
  test::expect_error<InvalidArgument>(
      [&] {
        align_batch(scene.context, clouds, {{0, 1}, {0, 1}}, RegistrationOptions{}, {},
                    {RegistrationPrior{}, bad});
      },
      {"priors[1].pose.max_rotation"});
  test::expect_error<InvalidArgument>(
      [&] {
        align(scene.context, scene.source, scene.target, RegistrationOptions::loopsmart(0.1f),
              scene.about_truth(10, 1));
      },
      {"method", "quadruples"});
}

}  // namespace
}  // namespace gpureg
