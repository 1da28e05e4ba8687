// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "gpureg/registration/scale.hpp"
#include "support/expect_error.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

/// A room seen twice; the source has another unit.
class ScaledPoses : public testing::Test {
 protected:
  ScaledPoses() {
    std::mt19937 random(5);
    target = thinned(test::scan_room(random));
    pose = test::random_pose(random);
    source = test::moved(pose.inverse(), thinned(test::scan_room(random)));
    for (Eigen::Vector3f& p : source) p = (p.cast<double>() / kFactor).cast<float>();
  }
  static std::vector<Eigen::Vector3f> thinned(const std::vector<Eigen::Vector3f>& points) {
    std::vector<Eigen::Vector3f> out;
    for (std::size_t k = 0; k < points.size(); k += 3) out.push_back(points[k]);
    return out;
  }
  UnalignedMatrix4d similarity(double scale) const {
    UnalignedMatrix4d out = pose.matrix();
    out.topLeftCorner<3, 3>() *= scale;
    return out;
  }
  std::vector<ScaledVerification> verified(const std::vector<UnalignedMatrix4d>& given,
                                           bool refine = false, int threads = 2) const {
    VerificationOptions verification;
    verification.refine = refine;
    return verify_scaled_poses(Context::cpu(threads), PointCloudView(source),
                               PointCloudView(target), given, options, verification);
  }
  static double error(const ScaledVerification& found, const UnalignedMatrix4d& truth,
                      const std::vector<Eigen::Vector3f>& points) {
    double most = 0;
    for (std::size_t k = 0; k < points.size(); k += 101) {
      const Eigen::Vector4d p = points[k].cast<double>().homogeneous();
      most = std::max(most, (found.similarity() * p - truth * p).norm());
    }
    return most;
  }

  static constexpr double kFactor = 2.5;
  RegistrationOptions options{0.1f};
  std::vector<Eigen::Vector3f> source, target;
  Eigen::Isometry3d pose;
};

TEST_F(ScaledPoses, TheTrueOneIsBelievedAndAFalseScaleIsNot) {
  const auto found = verified({similarity(1.15 * kFactor), similarity(kFactor)});
  ASSERT_EQ(found.size(), 2u);
  EXPECT_LT(found[0].verification.confidence, 0.1);
  EXPECT_GT(found[1].verification.confidence, 0.9);
  EXPECT_EQ(found[1].scale_status, ScaleStatus::known);
  EXPECT_NEAR(found[1].scale, kFactor, 1e-9);
  EXPECT_LT(found[1].scale_deviation, 0.01);
  EXPECT_GT(found[1].information(6, 6), 0);
  EXPECT_LT(error(found[1], similarity(kFactor), source), 1e-6);
}

TEST_F(ScaledPoses, HasTheVerdictOfTheScaledClouds) {
  std::vector<Eigen::Vector3f> scaled = source;
  for (Eigen::Vector3f& p : scaled) p = (p.cast<double>() * 2.0).cast<float>();
  const Context context = Context::cpu(1);
  UnalignedIsometry3d off;
  off = pose;
  off.translation() += Eigen::Vector3d(0.02, 0, 0.01);
  const auto plain =
      verify_poses(context, prepare(context, PointCloudView(scaled), options),
                   prepare(context, PointCloudView(target), options), {off}, options);
  UnalignedMatrix4d given = off.matrix();
  given.topLeftCorner<3, 3>() *= 2;
  const auto found = verified({given});
  EXPECT_EQ(found[0].verification.confidence, plain[0].confidence);
  EXPECT_EQ(found[0].verification.inliers, plain[0].inliers);
}

TEST_F(ScaledPoses, RefinesPoseAndScale) {
  UnalignedMatrix4d off = similarity(1.03 * kFactor);
  off.col(3).head<3>() += Eigen::Vector3d(0.05, -0.05, 0.03);
  const auto found = verified({off}, true);
  EXPECT_EQ(found[0].scale_status, ScaleStatus::found);
  EXPECT_NEAR(found[0].scale / kFactor, 1, 0.004);
  EXPECT_GT(found[0].verification.confidence, 0.9);
  EXPECT_LT(error(found[0], similarity(kFactor), source), 0.05);
}

TEST_F(ScaledPoses, TwoScalesShareWhatTheyAreWorth) {
  // The target holds the room twice, once half as large again.
  const std::size_t count = target.size();
  const Eigen::Vector3f aside(30, 0, 0);
  for (std::size_t k = 0; k < count; ++k) target.push_back(1.5f * target[k] + aside);
  UnalignedMatrix4d larger = similarity(1.5 * kFactor);
  larger.col(3).head<3>() *= 1.5;
  larger.col(3).head<3>() += aside.cast<double>();
  const double first = verified({similarity(kFactor)})[0].verification.confidence,
               second = verified({larger})[0].verification.confidence;
  EXPECT_GT(first, 0.8);
  EXPECT_GT(second, 0.8);
  const auto both = verified({similarity(kFactor), larger});
  const auto odds = [](double p) { return p / (1 - p); };
  EXPECT_NEAR(both[0].verification.confidence, odds(first) / (odds(first) + odds(second)), 1e-9);
  EXPECT_NEAR(both[1].verification.confidence, odds(second) / (odds(first) + odds(second)), 1e-9);
}

TEST_F(ScaledPoses, HasTheSameBitsOnAnyThreads) {
  const std::vector<UnalignedMatrix4d> given{similarity(1.02 * kFactor), similarity(3)};
  const auto one = verified(given, true, 1), three = verified(given, true, 3);
  for (std::size_t k = 0; k < given.size(); ++k) {
    EXPECT_EQ(one[k].scale, three[k].scale);
    EXPECT_EQ(one[k].information, three[k].information);
    EXPECT_EQ(one[k].verification.confidence, three[k].verification.confidence);
    EXPECT_EQ(one[k].similarity(), three[k].similarity());
  }
}

TEST_F(ScaledPoses, WithoutACommonSurfaceThereIsNoScale) {
  UnalignedMatrix4d far = similarity(kFactor);
  far.col(3).head<3>() += Eigen::Vector3d(100, 0, 0);
  const auto found = verified({far});
  EXPECT_EQ(found[0].scale_status, ScaleStatus::none);
  EXPECT_LT(found[0].verification.confidence, 0.1);
  EXPECT_TRUE(verified({}).empty());
}

TEST_F(ScaledPoses, NamesWhatIsNoSimilarity) {
  UnalignedMatrix4d bad = similarity(2);
  bad(0, 0) += 1;
  test::expect_error<InvalidArgument>([&] { verified({similarity(1), bad}); }, {"similarities[1]"});
  bad = similarity(2);
  bad(1, 1) = std::nan("");
  test::expect_error<InvalidArgument>([&] { verified({bad}); }, {"similarities[0]"});
  test::expect_error<InvalidArgument>([&] { verified({UnalignedMatrix4d::Zero()}); },
                                      {"similarities[0]"});
  bad = similarity(2);
  bad.topLeftCorner<3, 1>() *= -1;  // a mirror image
  test::expect_error<InvalidArgument>([&] { verified({bad}); }, {"determinant"});
  bad = similarity(2).transpose();
  test::expect_error<InvalidArgument>([&] { verified({bad}); }, {"last row"});
}

}  // namespace
}  // namespace gpureg
