// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "gpureg/calibration.hpp"
#include "support/expect_error.hpp"

namespace gpureg {
namespace {

using Samples = std::vector<CalibrationSample>;

Samples repeated(double confidence, std::size_t correct, std::size_t wrong) {
  Samples out(correct, {confidence, true});
  out.insert(out.end(), wrong, {confidence, false});
  return out;
}

// Without a false one of n the tail is (1 - max_risk)^n; a quarter of 5 % takes 42, 86, 437
// reports.
TEST(RiskControl, NeedsAsManyReportsAsTheBinomialTailSays) {
  const struct {
    double max_risk;
    std::size_t fewest;
  } cases[] = {{0.1, 42}, {0.05, 86}, {0.01, 437}};
  for (const auto& [max_risk, fewest] : cases) {
    RiskControl control;
    control.max_risk = max_risk;
    EXPECT_TRUE(control_risk(repeated(0.99, fewest, 0), control).supported) << max_risk;
    const RiskThreshold few = control_risk(repeated(0.99, fewest - 1, 0), control);
    EXPECT_FALSE(few.supported) << max_risk;
    EXPECT_EQ(few.min_confidence, 1) << "reports nothing";
    ASSERT_TRUE(few.more_samples) << max_risk;
    EXPECT_LE(*few.more_samples, 1 + fewest / 40) << "advice in steps of 2 %";
  }
}

// P(Bin(100, 0.1) <= 3) = 0.0078, P(Bin(100, 0.1) <= 4) = 0.0237: only the first is below 0.0125.
TEST(RiskControl, CountsFalseOnesByTheExactTail) {
  RiskControl control;
  control.max_risk = 0.1;
  EXPECT_TRUE(control_risk(repeated(0.9, 97, 3), control).supported);
  EXPECT_FALSE(control_risk(repeated(0.9, 96, 4), control).supported);
}

TEST(RiskControl, TakesTheLowestThresholdThatItCanProve) {
  Samples samples = repeated(0.95, 300, 1);
  const Samples middle = repeated(0.65, 100, 2), low = repeated(0.25, 50, 50);
  samples.insert(samples.end(), middle.begin(), middle.end());
  samples.insert(samples.end(), low.begin(), low.end());
  RiskControl control;
  control.max_risk = 0.05;
  const RiskThreshold found = control_risk(samples, control);
  EXPECT_TRUE(found.supported);
  EXPECT_EQ(found.min_confidence, 0.3) << "the lowest of the ladder above the false ones";
  EXPECT_EQ(found.samples, 503u);
  EXPECT_EQ(found.reported, 403u);
  EXPECT_EQ(found.wrong, 3u);
  EXPECT_DOUBLE_EQ(found.recall, 400.0 / 450);
  ConfidenceCalibration calibration;
  calibration.offset = 1;
  EXPECT_EQ(control_risk(samples, control, calibration).min_confidence, calibration(0.3));
}

TEST(RiskControl, SaysThatMoreSamplesDoNotHelp) {
  const RiskThreshold found = control_risk(repeated(0.9999, 90, 10));
  EXPECT_FALSE(found.supported);
  EXPECT_FALSE(found.more_samples);
}

TEST(RiskControl, WithoutSamples) {
  const RiskThreshold none = control_risk({});
  EXPECT_FALSE(none.supported);
  ASSERT_TRUE(none.more_samples);
  EXPECT_GE(*none.more_samples, 437u);
  EXPECT_FALSE(control_risk(repeated(0.01, 100, 0)).supported) << "nothing is reported";
}

TEST(RiskControl, RefusesBadValues) {
  for (const double bad : {0.0, 1.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    RiskControl risk, failure;
    risk.max_risk = failure.max_failure = bad;
    test::expect_error<InvalidArgument>([&] { control_risk({}, risk); }, {"max_risk"});
    test::expect_error<InvalidArgument>([&] { control_risk({}, failure); }, {"max_failure"});
  }
  test::expect_error<InvalidArgument>([&] { control_risk({{0.5, true}, {1.5, true}}); },
                                      {"samples[1].confidence", "1.5"});
}

/// A place with confidences in (0, 1) that are false with a probability of their own.
struct Place {
  const char* name;
  double (*false_share)(double confidence);
};

// The confidence may be wrong in any way: the promise has to hold in 95 % of the draws of samples.
// Of 1,000 draws, 50 failures are allowed on average; 71 are three standard deviations more.
TEST(RiskControl, KeepsThePromiseWhateverTheConfidenceIsWorth) {
  const Place places[] = {
      {"calibrated", [](double c) { return 0.3 * (1 - c); }},
      {"overconfident", [](double c) { return std::min(1.0, 3 * (1 - c) + 0.02); }},
      {"worst at the top", [](double c) { return c > 0.995 ? 0.5 : 0.3 * (1 - c); }},
      {"at the limit", [](double) { return 0.0501; }},
  };
  constexpr int kDraws = 1000;
  constexpr std::size_t kSamples = 400;
  constexpr double kStep = 1e-3;
  RiskControl control;
  control.max_risk = 0.05;
  std::mt19937_64 random(41);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const auto confidence = [](double u) { return 1 - u * u * u; };  // most are confident
  for (const Place& place : places) {
    int broken = 0, supported = 0;
    for (int d = 0; d < kDraws; ++d) {
      Samples samples;
      for (std::size_t k = 0; k < kSamples; ++k) {
        const double c = confidence(uniform());
        samples.push_back({c, uniform() >= place.false_share(c)});
      }
      const RiskThreshold found = control_risk(samples, control);
      if (!found.supported) continue;
      ++supported;
      double sum = 0, count = 0;  // the expected share, by the midpoint rule
      for (double u = kStep / 2; u < 1; u += kStep) {
        if (confidence(u) < found.min_confidence) break;
        sum += place.false_share(confidence(u));
        ++count;
      }
      broken += sum > control.max_risk * count;
    }
    EXPECT_LE(broken, 71) << place.name;
    if (place.name == std::string("calibrated")) EXPECT_GT(supported, kDraws / 2) << "of some use";
    if (place.name == std::string("at the limit")) EXPECT_GT(supported, 0) << "a hard case";
  }
}

}  // namespace
}  // namespace gpureg
