// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/time_budget.hpp"
#include "api/with_settings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "api/quality_levels.hpp"
#include "gpureg/error.hpp"
#include "support/expect_error.hpp"
#include "support/result_bytes.hpp"
#include "support/scan.hpp"

namespace gpureg {
namespace {

/// Levels whose times and results a test decides; its clock moves only while a level runs.
struct FakeLevels {
  double per_match = 2.5e-3, per_triangle = 1e-3, per_seed = 0.05, per_mode = 0.5, overhead = 1;
  double exponent = 1;  ///< below 1: a device that more work does not slow down in proportion
  std::function<double(std::uint32_t)> confidence = [](std::uint32_t) { return 0.5; };
  std::function<double(std::uint32_t)> shift = [](std::uint32_t) { return 0.0; };
  double clock = 1000;
  std::vector<std::uint32_t> run;

  RegistrationResult align(std::uint32_t quality) {
    run.push_back(quality);
    const RegistrationSettings o = resolve(RegistrationOptions{}).with_quality(quality);
    RegistrationResult result;
    result.confidence = confidence(quality);
    result.target_from_source.setIdentity();
    result.target_from_source.translation().x() = shift(quality);
    result.timings.match = std::pow(per_match * o.compatibility.max_matches, exponent);
    result.timings.propose =
        std::pow(per_triangle * o.compatibility.seeds * o.compatibility.triangles, exponent);
    result.timings.rank = std::pow(per_seed * o.compatibility.seeds, exponent);
    result.timings.refine = result.timings.verify = std::pow(per_mode * o.evidence.modes, exponent);
    clock += result.timings.total() + overhead;
    return result;
  }
  double time_of(std::uint32_t quality) const {
    FakeLevels copy = *this;
    copy.align(quality);
    return copy.clock - clock;
  }
  TimedResult within(double milliseconds) {
    run.clear();
    return run_levels(
        {[this](std::uint32_t quality) { return align(quality); }, [this] { return clock; }},
        milliseconds, resolve(RegistrationOptions{}));
  }
};

TEST(TimeBudget, IsKeptAndUsed) {
  for (const double exponent : {1.0, 0.7, 0.4})
    for (double budget = 60; budget < 20000; budget *= 1.3) {
      FakeLevels levels;
      levels.exponent = exponent;
      const TimedResult out = levels.within(budget);
      EXPECT_LE(out.milliseconds, 1.1 * budget) << "exponent " << exponent;
      EXPECT_EQ(out.levels, levels.run.size());
      EXPECT_TRUE(std::is_sorted(levels.run.begin(), levels.run.end()));
      EXPECT_EQ(out.highest_quality, levels.run.back());
      // The remaining time is too short for a further level.
      if (exponent == 1.0 && out.highest_quality < kHighestQuality)
        EXPECT_GT(out.milliseconds + levels.time_of(out.highest_quality + 1), budget);
    }
}

TEST(TimeBudget, TheLowestLevelIsAlwaysRun) {
  FakeLevels levels;
  const TimedResult out = levels.within(0.001);
  EXPECT_EQ(levels.run, std::vector<std::uint32_t>{0});
  EXPECT_EQ(out.quality, 0u);
  EXPECT_DOUBLE_EQ(out.milliseconds, levels.time_of(0));
}

TEST(TimeBudget, ConfidentAndStableResultsEndEarly) {
  FakeLevels levels;
  levels.confidence = [](std::uint32_t) { return 0.999; };
  EXPECT_EQ(levels.within(1e9).levels, 2u);
  EXPECT_EQ(levels.run, (std::vector<std::uint32_t>{0, 1}));
  // Confident, but of another pose each time: it continues.
  levels.shift = [](std::uint32_t quality) { return 1.0 * quality; };
  EXPECT_EQ(levels.within(1e9).highest_quality, kHighestQuality);
}

TEST(TimeBudget, TheMostConfidentLevelIsReturned) {
  FakeLevels levels;
  levels.confidence = [](std::uint32_t quality) { return quality == 0 ? 0.8 : 0.3; };
  const TimedResult out = levels.within(5000);
  EXPECT_GT(out.highest_quality, 0u);
  EXPECT_EQ(out.quality, 0u);
  EXPECT_DOUBLE_EQ(out.result.confidence, 0.8);
}

TEST(TimeBudget, PredictionsFollowTheStages) {
  StageTimings t;
  t.match = 1;
  t.propose = 5;
  t.rank = 4;
  t.refine = 5;
  t.verify = 6;
  RegistrationSettings from, to;
  to.compatibility.max_matches = 3 * from.compatibility.max_matches;
  to.compatibility.seeds = 2 * from.compatibility.seeds;
  to.compatibility.triangles = 3 * from.compatibility.triangles;
  to.evidence.modes = 2 * from.evidence.modes;
  EXPECT_DOUBLE_EQ(predicted_milliseconds(t, 7, from, from), 28);
  EXPECT_DOUBLE_EQ(predicted_milliseconds(t, 7, from, to), 7 + 3 + 5 * 6 + 4 * 2 + 11 * 2);
}

TEST(TimeBudget, ResultsAreThoseOfTheirLevel) {
  const Context context = Context::cpu(2);
  RegistrationOptions options{0.1f};
  std::mt19937 random(1);
  const std::vector<Eigen::Vector3f> a = test::scan_room(random), b = test::scan_room(random);
  const PreparedCloud source = prepare(context, PointCloudView(a), options);
  const PreparedCloud target = prepare(context, PointCloudView(b), options);
  // Half an hour: whatever the machine, it ends by itself, with every level or a stable pose.
  const TimedResult out = align_within(context, source, target, 1.8e6, options);
  EXPECT_GE(out.levels, 2u);
  EXPECT_GT(out.milliseconds, 0);
  options.quality = out.quality;
  const RegistrationResult alone = align(context, source, target, options);
  EXPECT_EQ(test::bytes(out.result), test::bytes(alone));
}

TEST(TimeBudget, BadInputIsNamed) {
  const Context context = Context::cpu(1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {nan, 0.0, -1.0, std::numeric_limits<double>::infinity()})
    test::expect_error<InvalidArgument>([&] { align_within(context, {}, {}, bad); },
                                        {"milliseconds"});
  test::expect_error<InvalidArgument>(
      [&] { align_within(context, {}, {}, 10, RegistrationOptions::loopsmart()); },
      {"method", "quadruples"});
  test::expect_error<InvalidArgument>([&] { align_within(context, {}, {}, 10); }, {"empty handle"});
  test::expect_error<InvalidArgument>([] { resolve(RegistrationOptions{}).with_quality(11); },
                                      {"quality"});
}

}  // namespace
}  // namespace gpureg
