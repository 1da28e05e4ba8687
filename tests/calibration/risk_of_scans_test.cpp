// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "gpureg/calibration.hpp"
#include "support/expect_error.hpp"

namespace gpureg {
namespace {

using Samples = std::vector<CalibrationSample>;

CalibrationSample pair(std::uint32_t source, std::uint32_t target, double confidence = 0.99,
                       bool correct = true) {
  return {confidence, correct, 1, CalibrationKind::trajectory, source, target};
}

Samples all_pairs(std::uint32_t scans) {
  Samples out;
  for (std::uint32_t j = 0; j < scans; ++j)
    for (std::uint32_t i = 0; i < j; ++i) out.push_back(pair(j, i));
  return out;
}

std::vector<std::uint32_t> one_group(std::uint32_t scans) {
  return std::vector<std::uint32_t>(scans, 0);
}

RiskThreshold of_one_group(const Samples& samples, std::uint32_t scans, double max_risk) {
  RiskControl control;
  control.max_risk = max_risk;
  return control_risk_of_scans(samples, one_group(scans), control);
}

// A place with a share p of bad scans, whose pairs are all false, has a risk of 1 - (1 - p)^2 and
// shows n good scans with a probability of (1 - p)^n: nobody can promise less with fewer than
// 2 log(0.05) / log(1 - risk) scans, which are 57, 117 and 597.
TEST(RiskOfScans, FewestScans) {
  const struct {
    double max_risk;
    std::uint32_t impossible, fewest;
  } cases[] = {{0.1, 56, 94}, {0.05, 116, 192}, {0.01, 596, 978}};
  for (const auto& [max_risk, impossible, fewest] : cases) {
    EXPECT_TRUE(of_one_group(all_pairs(fewest), fewest, max_risk).supported) << max_risk;
    EXPECT_FALSE(of_one_group(all_pairs(fewest - 2), fewest - 2, max_risk).supported) << max_risk;
    EXPECT_FALSE(of_one_group(all_pairs(impossible), impossible, max_risk).supported) << max_risk;
  }
}

TEST(RiskOfScans, SaysHowManyScansWouldDo) {
  for (const std::uint32_t scans : {0u, 2u, 24u, 51u}) {
    const RiskThreshold few = of_one_group(all_pairs(scans), scans, 0.05);
    EXPECT_FALSE(few.supported) << scans;
    EXPECT_EQ(few.min_confidence, 1) << "reports nothing";
    EXPECT_EQ(few.scans, scans);
    ASSERT_TRUE(few.more_scans) << scans;
    EXPECT_NEAR(static_cast<double>(scans + *few.more_scans), 192, 4)
        << "odd numbers leave one out";
  }
  Samples bad = all_pairs(40);
  for (std::size_t k = 0; k < bad.size(); k += 8) bad[k].correct = false;
  EXPECT_FALSE(of_one_group(bad, 40, 0.05).more_scans) << "no number of scans would do";
}

TEST(RiskOfScans, OneBadScanCountsOnceInARound) {
  Samples samples = all_pairs(400);
  for (CalibrationSample& sample : samples) sample.correct = sample.source % 200 != 7;
  EXPECT_TRUE(of_one_group(samples, 400, 0.05).supported) << "about one of a hundred pairs";
  for (CalibrationSample& sample : samples) sample.correct = sample.source % 40 != 7;
  EXPECT_FALSE(of_one_group(samples, 400, 0.05).supported);
}

TEST(RiskOfScans, PairsOfAGroupAreDisjointFromThoseOfOthers) {
  constexpr std::uint32_t kGroups = 8, kOfGroup = 12;
  Samples samples;
  std::vector<std::uint32_t> groups(kGroups * kOfGroup + 1, kNoScanGroup);
  for (std::uint32_t g = 0; g < kGroups; ++g)
    for (std::uint32_t j = 0; j < kOfGroup; ++j) {
      groups[g * kOfGroup + j] = 10 * g;
      for (std::uint32_t i = 0; i < j; ++i)
        samples.push_back(pair(g * kOfGroup + i, g * kOfGroup + j, 0.65));
    }
  RiskControl control;
  control.max_risk = 0.1;
  const RiskThreshold found = control_risk_of_scans(samples, groups, control);
  EXPECT_TRUE(found.supported) << "as 96 scans of which all pairs were aligned";
  EXPECT_EQ(found.min_confidence, 0.05);
  EXPECT_EQ(found.scans, kGroups * kOfGroup);
  EXPECT_EQ(found.reported, samples.size());
  EXPECT_EQ(found.recall, 1);
  std::reverse(samples.begin(), samples.end());
  for (CalibrationSample& sample : samples) std::swap(sample.source, sample.target);
  ConfidenceCalibration calibration;
  calibration.offset = 1;
  EXPECT_EQ(control_risk_of_scans(samples, groups, control, calibration).min_confidence,
            calibration(0.05));
}

TEST(RiskOfScans, BadInputsAreNamed) {
  const auto refused = [](const Samples& samples, std::initializer_list<std::string> words) {
    test::expect_error<InvalidArgument>(
        [&] { control_risk_of_scans(samples, {0, 0, 1, 1, kNoScanGroup}); }, words);
  };
  refused({pair(0, 1), pair(2, 2)}, {"samples[1].target is 2", "another scan"});
  refused({pair(0, 5)}, {"samples[0].target is 5", "number of a scan"});
  refused({pair(9, 1)}, {"samples[0].source is 9", "number of a scan"});
  refused({pair(0, 2)}, {"samples[0].target is 2", "group"});
  refused({pair(4, 4)}, {"samples[0].target is 4"});
  refused({pair(0, 1), pair(1, 0)}, {"samples[1].target is 0", "given once"});
  refused({pair(0, 1, 1.5)}, {"samples[0].confidence", "1.5"});
}

/// A folder of scans of which a share is bad: pairs with a bad scan are false with a probability.
/// Most pairs are confident, whether they are right or not.
class Folder {
 public:
  Folder(std::uint64_t seed, std::uint32_t scans, double bad_share, double false_share)
      : random_(seed) {
    std::vector<bool> bad;
    for (std::uint32_t k = 0; k < scans; ++k) bad.push_back(uniform() < bad_share);
    for (std::uint32_t j = 0; j < scans; ++j)
      for (std::uint32_t i = 0; i < j; ++i) {
        const double u = uniform();
        samples.push_back(
            pair(j, i, 1 - u * u * u, !((bad[i] || bad[j]) && uniform() < false_share)));
      }
  }
  Samples samples;

 private:
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  std::mt19937_64 random_;
};

// The promise has to hold in 95 % of the folders, whatever their size and the share of bad scans.
// Of 200 folders 10 may break it on average; 19 are three standard deviations more.
TEST(RiskOfScans, KeepsThePromiseInFoldersWithBadScans) {
  const double promises[] = {0.01, 0.05, 0.1};
  int worst_as_pairs = 0;
  for (const double bad_share : {0.02, 0.06, 0.1})
    for (const double false_share : {0.5, 1.0})
      for (const std::uint32_t scans : {12u, 24u, 36u, 50u, 100u, 200u}) {
        const double risk = false_share * (1 - (1 - bad_share) * (1 - bad_share));
        const bool small = scans <= 50;
        int broken[3] = {}, as_pairs[3] = {};
        for (unsigned draw = 0; draw < (small ? 200 : 40); ++draw) {
          const Folder folder(1000 * scans + draw, scans, bad_share, false_share);
          for (int k = 0; k < 3; ++k) {
            if (risk <= promises[k]) continue;  // every answer keeps it
            broken[k] += of_one_group(folder.samples, scans, promises[k]).supported ? 1 : 0;
            if (!small) continue;
            RiskControl control;
            control.max_risk = promises[k];
            as_pairs[k] += control_risk(folder.samples, control).supported ? 1 : 0;
          }
        }
        for (int k = 0; k < 3; ++k) {
          EXPECT_LE(broken[k], small ? 19 : 6)
              << bad_share << " bad, " << false_share << " of their pairs false, " << scans
              << " scans, " << promises[k];
          worst_as_pairs = std::max(worst_as_pairs, as_pairs[k]);
        }
        if (bad_share == 0.06 && small && scans > 12 && false_share == 0.5)
          EXPECT_GT(as_pairs[1], 40) << scans;
      }
  EXPECT_GT(worst_as_pairs, 90);
}

TEST(RiskOfScans, IsOfUseInLargeFolders) {
  const struct {
    std::uint32_t scans;
    double bad_share, max_risk;
  } cases[] = {{200, 0.005, 0.1}, {400, 0.01, 0.1}, {400, 0.002, 0.05}};
  for (const auto& [scans, bad_share, max_risk] : cases) {
    int supported = 0;
    for (unsigned draw = 0; draw < 20; ++draw) {
      const RiskThreshold found =
          of_one_group(Folder(draw, scans, bad_share, 1).samples, scans, max_risk);
      supported += found.supported && found.min_confidence <= 0.5 ? 1 : 0;
    }
    EXPECT_GE(supported, 15) << scans << " scans, " << max_risk;
  }
}

}  // namespace
}  // namespace gpureg
