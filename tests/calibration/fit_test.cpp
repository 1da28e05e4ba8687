// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "gpureg/calibration.hpp"
#include "support/expect_error.hpp"

namespace gpureg {
namespace {

double logistic(double x) { return 1 / (1 + std::exp(-x)); }

/// Samples whose true log odds are offset + slope * x, of confidences that say x.
std::vector<CalibrationSample> distorted(double slope, double offset, std::size_t count) {
  std::mt19937 random(7);
  std::vector<CalibrationSample> out;
  for (std::size_t k = 0; k < count; ++k) {
    const double x = 10.0 * random() / 4294967296.0 - 5.0;
    const double u = random() / 4294967296.0;
    out.push_back({logistic(x), u < logistic(offset + slope * x)});
  }
  return out;
}

TEST(FitCalibration, RecoversAKnownDistortion) {
  // Of 20,000 samples the standard errors are about 0.02.
  const struct {
    double slope, offset;
  } cases[] = {{0.5, 1}, {1.6, -0.8}, {1, 0}, {0.8, -1.5}};
  for (const auto& want : cases) {
    const CalibrationFit fit = fit_calibration(distorted(want.slope, want.offset, 20000));
    EXPECT_TRUE(fit.enough_samples);
    EXPECT_NEAR(fit.calibration.slope, want.slope, 0.08);
    EXPECT_NEAR(fit.calibration.offset, want.offset, 0.1);
    EXPECT_LT(fit.error_after, 0.02);
  }
}

TEST(FitCalibration, TheErrorIsThatOfTheSamples) {
  // Bin 2: 4 samples of 0.25, one correct; bin 9: two of 0.95, one correct.
  std::vector<CalibrationSample> samples(4, {0.25, false});
  samples[0].correct = true;
  samples.push_back({0.95, true});
  samples.push_back({0.95, false});
  EXPECT_NEAR(calibration_error(samples), (0.0 + 2 * 0.45) / 6, 1e-15);
  samples.back().weight = 0;
  EXPECT_NEAR(calibration_error(samples), 0.05 / 5, 1e-15);
  EXPECT_EQ(calibration_error({}), 0);
  EXPECT_NEAR(calibration_error({{1.0, true}, {0.0, true}}), 0.5, 1e-15);
}

TEST(FitCalibration, FewSamplesStayNearTheIdentity) {
  const std::vector<CalibrationSample> many = distorted(0.5, 2, 4000);
  const std::vector<CalibrationSample> few(many.begin(), many.begin() + 60);
  const ConfidenceCalibration sure = fit_calibration(many).calibration;
  std::vector<CalibrationSample> light = few;
  for (CalibrationSample& sample : light) sample.weight = 0.02;
  const ConfidenceCalibration unsure = fit_calibration(light).calibration;
  EXPECT_LT(std::abs(unsure.offset), 0.5 * std::abs(sure.offset));
  EXPECT_LT(std::abs(unsure.slope - 1), 0.5 * std::abs(sure.slope - 1));
}

TEST(FitCalibration, TooFewSamplesGiveTheIdentity) {
  std::vector<CalibrationSample> samples(500, {0.3, true});
  for (std::size_t k = 0; k + 1 < kMinCalibrationSamples; ++k) samples[k].correct = false;
  const CalibrationFit fit = fit_calibration(samples);
  EXPECT_FALSE(fit.enough_samples);
  EXPECT_TRUE(fit.calibration.is_identity());
  EXPECT_EQ(fit.error_before, fit.error_after);
  samples[400].correct = false;
  EXPECT_TRUE(fit_calibration(samples).enough_samples);
  // Samples without weight do not count.
  samples[400].weight = 0;
  EXPECT_FALSE(fit_calibration(samples).enough_samples);
}

TEST(FitCalibration, TheSlopeHasBounds) {
  std::vector<CalibrationSample> sharp, reversed;
  for (int k = 0; k < 4000; ++k) {
    const double x = 0.002 * k - 4;
    sharp.push_back({logistic(0.2 * x), x > 0});
    reversed.push_back({logistic(x), x < 0});
  }
  EXPECT_EQ(fit_calibration(sharp).calibration.slope, kMaxCalibrationSlope);
  EXPECT_EQ(fit_calibration(reversed).calibration.slope, kMinCalibrationSlope);
  EXPECT_TRUE(std::isfinite(fit_calibration(reversed).calibration.offset));
}

TEST(FitCalibration, ExtremeConfidencesAreFine) {
  std::vector<CalibrationSample> samples = distorted(1, 0, 400);
  for (const double c : {0.0, 1.0, 1e-300, 5e-324, 1 - 1e-16}) {
    samples.push_back({c, true});
    samples.push_back({c, false});
  }
  const CalibrationFit fit = fit_calibration(samples);
  EXPECT_TRUE(std::isfinite(fit.calibration.slope) && std::isfinite(fit.calibration.offset));
  EXPECT_GT(fit.calibration.slope, 0.4);
}

TEST(FitCalibration, SameBitsOnEveryMachine) {
  const ConfidenceCalibration fit = fit_calibration(distorted(0.7, -0.4, 300)).calibration;
  std::vector<CalibrationSample> again = distorted(0.7, -0.4, 300);
  EXPECT_EQ(fit.slope, fit_calibration(again).calibration.slope);
  // Only + - * / and sqrt are used after the samples, whose confidences std::exp may round
  // differently: exact values of samples that are exact.
  std::vector<CalibrationSample> exact;
  for (int k = 0; k < 64; ++k) exact.push_back({(k + 1) / 65.0, k * 37 % 64 < k});
  const ConfidenceCalibration golden = fit_calibration(exact).calibration;
  EXPECT_EQ(golden.slope, 0x1.0cc24cbf4dc1dp+0);
  EXPECT_EQ(golden.offset, -0x1.7461fd56e19e2p-3);
}

TEST(FitCalibration, BadSamplesAreNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  test::expect_error<InvalidArgument>([&] { fit_calibration({{0.5, true}, {nan, true}}); },
                                      {"samples[1].confidence"});
  test::expect_error<InvalidArgument>([&] { fit_calibration({{1.5, true}}); },
                                      {"samples[0].confidence", "1.5"});
  test::expect_error<InvalidArgument>([&] { fit_calibration({{0.5, true, -1}}); },
                                      {"samples[0].weight", "-1"});
  test::expect_error<InvalidArgument>([&] { calibration_error({{0.5, true, nan}}); },
                                      {"samples[0].weight"});
}

}  // namespace
}  // namespace gpureg
