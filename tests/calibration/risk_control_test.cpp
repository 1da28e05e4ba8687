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

/// Scenes of different difficulty: in some of them confident poses are false.
std::vector<Samples> random_scenes(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit;
  std::vector<Samples> scenes(count);
  for (Samples& scene : scenes) {
    const double aliases = 0.3 * std::pow(unit(random), 3);
    for (std::size_t k = 20 + random() % 60; k > 0; --k) {
      // In steps, so that confidences are equal now and then.
      const double confidence = std::floor(100 * unit(random)) / 100;
      scene.push_back({confidence, unit(random) < confidence * (1 - aliases)});
    }
  }
  return scenes;
}

bool keeps(const Samples& scene, double threshold, double max_risk) {
  double reported = 0, wrong = 0;
  for (const CalibrationSample& sample : scene)
    if (sample.confidence >= threshold) {
      ++reported;
      wrong += sample.correct ? 0 : 1;
    }
  return wrong <= max_risk * reported;
}

// All thresholds, from the top down, until more scenes fail than may.
TEST(RiskOfScenes, IsTheLowestThresholdByBruteForce) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const std::size_t count = seed % 3 == 0 ? 19 : seed % 3 == 1 ? 39 : 65;
    const std::size_t may_fail = (count + 1) / 20 - 1;
    const std::vector<Samples> scenes = random_scenes(count, seed);
    RiskControl control;
    control.max_risk = seed % 2 == 0 ? 0.1 : 0.3;
    double lowest = 2;
    std::vector<char> failed(count, 0);
    for (int step = 100; step >= 5; --step) {
      std::size_t failures = 0;
      for (std::size_t k = 0; k < count; ++k) {
        if (!keeps(scenes[k], step / 100.0, control.max_risk)) failed[k] = 1;
        failures += failed[k] != 0 ? 1 : 0;
      }
      if (failures > may_fail) break;
      lowest = step / 100.0;
    }
    const RiskThreshold found = control_risk_of_scenes(scenes, control);
    EXPECT_EQ(found.scenes, count);
    EXPECT_TRUE(found.supported) << seed;
    // It lies right above the last confidence that fails.
    EXPECT_GT(found.min_confidence, lowest - 0.0101) << seed;
    EXPECT_LE(found.min_confidence, lowest) << seed;
  }
}

// Of n + 1 scenes, each held out once, at most as many fail as the promise says: no luck needed.
TEST(RiskOfScenes, HoldsForScenesThatWereLeftOut) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const std::vector<Samples> scenes = random_scenes(40, 100 + seed);
    RiskControl control;
    control.max_risk = 0.2;
    int failures = 0;
    for (std::size_t k = 0; k < scenes.size(); ++k) {
      std::vector<Samples> others = scenes;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
      const RiskThreshold found = control_risk_of_scenes(others, control);
      failures +=
          keeps(scenes[k], found.supported ? found.min_confidence : 2, control.max_risk) ? 0 : 1;
    }
    EXPECT_LE(failures, 2) << seed;
  }
}

TEST(RiskOfScenes, AbstainsWithTooFewScenes) {
  const std::vector<Samples> scenes(18, repeated(0.99, 1000, 0));
  const RiskThreshold few = control_risk_of_scenes(scenes);
  EXPECT_FALSE(few.supported);
  EXPECT_EQ(few.min_confidence, 1);
  EXPECT_EQ(few.more_scenes, 1u);
  EXPECT_EQ(control_risk_of_scenes({}).more_scenes, 19u);
  RiskControl control;
  control.max_failure = 0.1;
  EXPECT_TRUE(control_risk_of_scenes(scenes, control).supported);
  control.max_failure = 0.01;
  EXPECT_EQ(control_risk_of_scenes(scenes, control).more_scenes, 81u);
}

// 19 scenes allow for no failure, 39 for one.
TEST(RiskOfScenes, OneSceneOfManyMayFail) {
  for (const std::size_t count : {19u, 38u, 39u}) {
    std::vector<Samples> scenes(count, repeated(0.9, 50, 0));
    scenes.back() = repeated(1, 5, 5);
    const RiskThreshold found = control_risk_of_scenes(scenes);
    EXPECT_EQ(found.supported, count == 39) << count;
    EXPECT_FALSE(found.more_scenes) << "as many as are needed at least";
  }
}

TEST(RiskOfScenes, CountsAndCalibrates) {
  std::vector<Samples> scenes(19, repeated(0.9, 9, 0));
  for (Samples& scene : scenes) scene.insert(scene.end(), {{0.6, true}, {0.6, false}, {0.3, true}});
  ConfidenceCalibration calibration;
  calibration.slope = 0.7;
  calibration.offset = -1;
  RiskControl control;
  control.max_risk = 0.05;
  const RiskThreshold found = control_risk_of_scenes(scenes, control, calibration);
  EXPECT_EQ(found.min_confidence, std::nextafter(calibration(0.6), 1));
  EXPECT_EQ(found.samples, 19u * 12);
  EXPECT_EQ(found.reported, 19u * 9);
  EXPECT_EQ(found.wrong, 0u);
  EXPECT_DOUBLE_EQ(found.recall, 9.0 / 11);
  control.max_risk = 0.1;
  EXPECT_EQ(control_risk_of_scenes(scenes, control, calibration).min_confidence, calibration(0.05))
      << "one of eleven is kept from every threshold on";
}

TEST(RiskOfScenes, BadInputsAreNamed) {
  std::vector<Samples> scenes(19, repeated(0.9, 9, 0));
  scenes[3].clear();
  test::expect_error<InvalidArgument>([&] { control_risk_of_scenes(scenes); }, {"scenes[3].size"});
  scenes[3] = repeated(1.5, 1, 0);
  test::expect_error<InvalidArgument>([&] { control_risk_of_scenes(scenes); },
                                      {"scenes[3][0].confidence"});
}

}  // namespace
}  // namespace gpureg
