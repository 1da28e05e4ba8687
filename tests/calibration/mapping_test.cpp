// SPDX-License-Identifier: BSD-3-Clause
// Every way to a confidence goes through the calibration.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "confidence/calibrate_modes.hpp"
#include "gpureg/prior.hpp"
#include "gpureg/time_budget.hpp"
#include "gpureg/verification.hpp"
#include "support/expect_error.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

using confidence::calibrate_modes;
using confidence::ModeConfidence;

constexpr float kVoxelSize = 0.1f;

RegistrationOptions options_with(const ConfidenceCalibration& calibration) {
  RegistrationOptions options{kVoxelSize};
  options.calibration = calibration;
  return options;
}

/// Two scans of a room.
struct Scene {
  Scene() {
    std::mt19937 random(4);
    target_points = test::scan_room(random);
    truth = test::random_pose(random);
    source_points = test::moved(truth.inverse(), test::scan_room(random));
    const Eigen::Vector3f eye = test::kRoomSensor;
    source_eye = (truth.inverse() * eye.cast<double>()).cast<float>();
    const RegistrationOptions prepare_options = options_with({});
    source = prepare(context, source_view(), prepare_options);
    target = prepare(context, target_view(), prepare_options);
  }
  PointCloudView source_view() const {
    PointCloudView view(source_points);
    view.viewpoints = source_eye.data();
    view.viewpoint_count = 1;
    return view;
  }
  PointCloudView target_view() const {
    PointCloudView view(target_points);
    view.viewpoints = test::kRoomSensor.data();
    view.viewpoint_count = 1;
    return view;
  }
  Context context = Context::cpu(2);
  std::vector<Eigen::Vector3f> source_points, target_points;
  Eigen::Isometry3d truth;
  Eigen::Vector3f source_eye;
  PreparedCloud source, target;
};

const Scene& scene() {
  static const Scene scene;
  return scene;
}

const ConfidenceCalibration kCalibrations[] = {{0.5, -1}, {1, 2}, {2.5, 0.5}, {0.3, -3}};

/// align() of a path without and with a calibration: poses and evidence are the same, confidences
/// are mapped.
template <typename Align>
void expect_mapped(const Align& align) {
  const RegistrationResult plain = align(options_with({}));
  ASSERT_FALSE(plain.modes.empty());
  ASSERT_EQ(plain.equivalent_poses(), 1u);
  ASSERT_GT(plain.confidence, 0.5);
  ASSERT_LT(plain.confidence, 1.0);
  for (const ConfidenceCalibration& calibration : kCalibrations) {
    const RegistrationResult mapped = align(options_with(calibration));
    EXPECT_EQ(mapped.confidence, calibration(plain.confidence));
    EXPECT_NE(mapped.confidence, plain.confidence);
    ASSERT_EQ(mapped.modes.size(), plain.modes.size());
    double sum = 0;
    for (std::size_t k = 0; k < mapped.modes.size(); ++k) {
      const RegistrationMode &a = plain.modes[k], &b = mapped.modes[k];
      EXPECT_EQ(a.target_from_source.matrix(), b.target_from_source.matrix());
      EXPECT_LE(b.overlap_confidence, b.confidence);
      sum += b.confidence;
      for (std::size_t j = 0; j < k; ++j)
        EXPECT_EQ(plain.modes[j].confidence >= a.confidence,
                  mapped.modes[j].confidence >= b.confidence);
    }
    EXPECT_LE(sum, 1.0 + 1e-12);
    EXPECT_EQ(mapped.aligned(), mapped.confidence >= 0.5);
  }
}

TEST(Calibration, AlignPreparedClouds) {
  expect_mapped([](const RegistrationOptions& options) {
    return align(scene().context, scene().source, scene().target, options);
  });
}

TEST(Calibration, AlignViews) {
  expect_mapped([](const RegistrationOptions& options) {
    return align(scene().context, scene().source_view(), scene().target_view(), options);
  });
}

TEST(Calibration, AlignSwapped) {
  expect_mapped([](RegistrationOptions options) {
    const bool larger = scene().source.size() > scene().target.size();
    options.tune = larger ? "smaller_as_source=true" : "smaller_as_source=false";
    return align(scene().context, scene().source, scene().target, options);
  });
}

TEST(Calibration, AlignWithAPrior) {
  RegistrationPrior prior;
  prior.pose = PosePrior{scene().truth, 60, 3};
  expect_mapped([&](const RegistrationOptions& options) {
    return align(scene().context, scene().source, scene().target, options, prior);
  });
}

TEST(Calibration, AlignBatch) {
  for (const std::size_t k : {0u, 1u})
    expect_mapped([&](const RegistrationOptions& options) {
      return align_batch(scene().context, {scene().source, scene().target}, {{0, 1}, {1, 0}},
                         options)[k];
    });
}

TEST(Calibration, AlignWithUnknownViewpoints) {
  expect_mapped([](const RegistrationOptions& options) {
    PointCloudView source(scene().source_points), target(scene().target_points);
    source.infer_viewpoint = target.infer_viewpoint = false;
    return align(scene().context, source, target, options);
  });
}

TEST(Calibration, AlignGivenCorrespondences) {
  // The nearest target point of each source point under the true pose.
  std::vector<Correspondence> correspondences;
  const auto from = scene().source.points(), to = scene().target.points();
  for (std::uint32_t i = 0; i < from.size(); i += 3) {
    const Eigen::Vector3f p = (scene().truth * from[i].cast<double>()).cast<float>();
    std::uint32_t best = 0;
    for (std::uint32_t j = 1; j < to.size(); ++j)
      if ((to[j] - p).squaredNorm() < (to[best] - p).squaredNorm()) best = j;
    correspondences.push_back({i, best});
    correspondences.push_back({i, (best + 700) % static_cast<std::uint32_t>(to.size())});
  }
  const auto with = [&](const ConfidenceCalibration& calibration) {
    RegistrationPrior prior;
    prior.correspondences = correspondences;
    return align(scene().context, scene().source, scene().target, options_with(calibration), prior);
  };
  const RegistrationResult plain = with({});
  ASSERT_TRUE(plain.has_pose());
  EXPECT_EQ(with({0.5, -1}).confidence, ConfidenceCalibration({0.5, -1})(plain.confidence));
}

TEST(Calibration, AlignWithin) {
  // A budget that lets only the lowest quality run.
  const auto within = [&](const ConfidenceCalibration& calibration) {
    return align_within(scene().context, scene().source, scene().target, 1e-3,
                        options_with(calibration))
        .result.confidence;
  };
  const double plain = within({});
  ASSERT_GT(plain, 0);
  EXPECT_EQ(within({0.5, -1}), ConfidenceCalibration({0.5, -1})(plain));
}

TEST(Calibration, VerifyPoses) {
  for (const bool search : {true, false}) {
    VerificationOptions verification;
    verification.search_alternatives = search;
    const auto verified = [&](const ConfidenceCalibration& calibration) {
      return verify_poses(scene().context, scene().source, scene().target, {scene().truth},
                          options_with(calibration), verification)[0];
    };
    const PoseVerification plain = verified({});
    ASSERT_GT(plain.confidence, 0.5);
    for (const ConfidenceCalibration& calibration : kCalibrations) {
      const PoseVerification mapped = verified(calibration);
      EXPECT_EQ(mapped.confidence, calibration(plain.confidence)) << search;
      EXPECT_LE(mapped.overlap_confidence, mapped.confidence);
    }
  }
  // A mode gets the confidence that align() gives it.
  RegistrationOptions options = options_with({0.5, -1});
  const RegistrationResult found = align(scene().context, scene().source, scene().target, options);
  EXPECT_EQ(verify_poses(scene().context, scene().source, scene().target,
                         {found.target_from_source}, options)[0]
                .confidence,
            found.confidence);
}

TEST(Calibration, TheIdentityLeavesTheBits) {
  RegistrationOptions plain = options_with({}), identity = plain;
  identity.calibration = {1.0, 0.0};
  EXPECT_EQ(test::bytes(align(scene().context, scene().source, scene().target, plain)),
            test::bytes(align(scene().context, scene().source, scene().target, identity)));
  std::vector<ModeConfidence> modes = {{0.7, 0.6}, {0.1, 0.1}, {1e-30, 0}};
  calibrate_modes({}, {false, true, false}, modes);
  EXPECT_EQ(modes[0].confidence, 0.7);
  EXPECT_EQ(modes[1].overlap_confidence, 0.1);
  EXPECT_EQ(modes[2].confidence, 1e-30);
}

TEST(Calibration, EquivalentModesShareTheMappedProbability) {
  const ConfidenceCalibration calibration{1, 1};
  std::vector<ModeConfidence> modes = {{0.4, 0.4}, {0.38, 0.1}, {0.1, 0.05}};
  calibrate_modes(calibration, {false, true, false}, modes);
  EXPECT_NEAR(modes[0].confidence + modes[1].confidence, calibration(0.78), 1e-12);
  EXPECT_NEAR(modes[1].confidence / modes[0].confidence, 0.38 / 0.4, 1e-12);
  EXPECT_NEAR(modes[2].confidence, 1 - calibration(0.78), 1e-12);
  EXPECT_NEAR(modes[1].overlap_confidence / modes[1].confidence, 0.1 / 0.38, 1e-12);
}

TEST(Calibration, AtMostOneModeIsCorrect) {
  // Twenty hopeless modes: mapped one by one, they would add up to more than two.
  std::vector<ModeConfidence> modes(21, {0.002, 0.001});
  modes[0] = {0.9, 0.8};
  calibrate_modes({0.3, 0}, std::vector<bool>(21), modes);
  double sum = 0;
  for (const ModeConfidence& mode : modes) sum += mode.confidence;
  EXPECT_LE(sum, 1.0);
  EXPECT_EQ(modes[0].confidence, ConfidenceCalibration({0.3, 0})(0.9));
  // A share of 0.3 of four equal modes may be too modest; the others then get what is left.
  std::vector<ModeConfidence> equal(3, {0.3, 0.3});
  calibrate_modes({1, 3}, std::vector<bool>(3), equal);
  EXPECT_EQ(equal[0].confidence, ConfidenceCalibration({1, 3})(0.3));
  EXPECT_NEAR(equal[0].confidence + equal[1].confidence + equal[2].confidence, 1.0, 1e-12);
}

TEST(Calibration, TheMappingKeepsOrderAndLimits) {
  for (const ConfidenceCalibration& calibration : kCalibrations) {
    EXPECT_EQ(calibration(0), 0);
    EXPECT_EQ(calibration(1), 1);
    double last = 0;
    for (const double c : {1e-20, 1e-9, 0.01, 0.3, 0.5, 0.7, 0.99, 1 - 1e-5}) {
      EXPECT_GT(calibration(c), last);
      EXPECT_LT(calibration(c), 1);
      last = calibration(c);
    }
  }
  EXPECT_NEAR(ConfidenceCalibration({2, 0})(0.75), 0.9, 1e-15);
  EXPECT_NEAR(ConfidenceCalibration({1, std::log(9)})(0.5), 0.9, 1e-15);
}

TEST(Calibration, BadValuesAreNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinity = std::numeric_limits<double>::infinity();
  for (const double slope : {0.0, -1.0, nan, infinity})
    test::expect_error<InvalidArgument>([&] { options_with({slope, 0}).validate(); },
                                        {"calibration.slope"});
  for (const double offset : {nan, infinity})
    test::expect_error<InvalidArgument>([&] { options_with({1, offset}).validate(); },
                                        {"calibration.offset"});
  test::expect_error<InvalidArgument>(
      [&] { align(scene().context, scene().source, scene().target, options_with({-1, 0})); },
      {"calibration.slope is -1"});
}

}  // namespace
}  // namespace gpureg
