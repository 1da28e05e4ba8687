// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>

#include "gpureg/result.hpp"

namespace gpureg {
namespace {

/// A result that nothing speaks against but its confidence.
RegistrationResult unsure() {
  RegistrationResult result;
  result.statistics.source_points = 5000;
  result.statistics.target_points = 6000;
  result.statistics.points_scored = 5000;
  result.statistics.inliers = 2500;
  RegistrationMode mode;
  mode.confidence = 0.2;
  PoseEvidence& e = mode.evidence;
  e.source_overlap = 0.5;
  e.target_overlap = 0.45;
  e.information_eigenvalues = {200, 300, 400, 500, 1000, 1100};
  e.weakest_direction = {0, 0, 0, 1, 0, 0};
  result.modes = {mode};
  return result;
}

/// What the result is not confident for, and the sentence with its numbers.
void expect_reason(RegistrationResult result, RegistrationReason reason,
                   const std::string& fragment) {
  EXPECT_EQ(diagnose(result), reason) << to_string(diagnose(result));
  result.reason = reason;
  EXPECT_NE(explain(result).find(fragment), std::string::npos) << explain(result);
  EXPECT_STRNE(advice(reason), "");
}

TEST(Reason, WeakEvidence) {
  expect_reason(unsure(), RegistrationReason::confidence_too_low,
                "it brings 50 % of the source and 45 % of the target together");
}

TEST(Reason, FewPoints) {
  RegistrationResult result = unsure();
  result.statistics.target_points = 122;
  expect_reason(result, RegistrationReason::too_few_points, "the target has 122 points");
  result.statistics.inliers = 0;
  expect_reason(result, RegistrationReason::too_few_points, "the target has 122 points");
}

TEST(Reason, NoCandidate) {
  RegistrationResult result = unsure();
  result.statistics.inliers = 0;
  expect_reason(result, RegistrationReason::no_candidate, "no pose brings points");
  result = unsure();
  result.modes.clear();
  expect_reason(result, RegistrationReason::no_candidate, "no pose brings points");
}

TEST(Reason, LittleOverlap) {
  RegistrationResult result = unsure();
  PoseEvidence& e = result.modes.front().evidence;
  e.source_overlap = 0.25;
  e.target_overlap = 0.06;
  expect_reason(result, RegistrationReason::too_little_overlap,
                "only 25 % of the source and 6.0 % of the target");
  // False poses of clouds without overlap contradict free space, which is no cause.
  e.source_observed = 0.3;
  e.source_free_space_violation = 0.2;
  EXPECT_EQ(diagnose(result), RegistrationReason::too_little_overlap);
  // A part that lies on a scene overlaps, although little of the scene does.
  e.source_overlap = 0.9;
  e.source_free_space_violation = 0;
  EXPECT_EQ(diagnose(result), RegistrationReason::confidence_too_low);
}

TEST(Reason, Clutter) {
  RegistrationResult result = unsure();
  PoseEvidence& e = result.modes.front().evidence;
  e.source_overlap_any_normal = 0.768;
  e.target_overlap_any_normal = 0.753;
  e.source_overlap = 0.076;
  e.target_overlap = 0.075;
  expect_reason(result, RegistrationReason::clutter,
                "77 % of the points of a cloud are close to the other one, but only 7.6 %");
  e.source_overlap = 0.3;  // a wrong pose in a street
  e.target_overlap = 0.25;
  EXPECT_NE(diagnose(result), RegistrationReason::clutter);
}

TEST(Reason, FreeSpace) {
  RegistrationResult result = unsure();
  PoseEvidence& e = result.modes.front().evidence;
  e.target_observed = 0.3;
  e.target_free_space_violation = 0.125;
  expect_reason(result, RegistrationReason::contradicts_free_space,
                "12 % of the points in view of the other cloud's sensor lie where it saw free");
  e.target_observed = 0;
  e.target_free_space_violation = 0;
  e.source_front_violation_near = 0.09;
  e.source_front_violation_far = 0.08;
  expect_reason(result, RegistrationReason::contradicts_free_space,
                "17 % of the points of a cloud hang in front of surfaces");
}

TEST(Reason, FreeMotions) {
  RegistrationResult result = unsure();
  PoseEvidence& e = result.modes.front().evidence;
  e.information_eigenvalues = {20, 1000, 3000, 4000, 5000, 6000};
  e.weakest_direction = {0, 0.1, 0, 0.8, -0.6, 0};
  expect_reason(result, RegistrationReason::underconstrained,
                "slide along (0.80, -0.60, 0.00) in the target's frame");
  e.information_eigenvalues = {20, 1100, 3000, 4000, 5000, 6000};
  e.weakest_direction = {0, 0, -1, 0.1, 0, 0};
  expect_reason(result, RegistrationReason::underconstrained,
                "turn about (0.00, 0.00, -1.00) in the target's frame");
  e.information_eigenvalues = {0, 0, 1, 500, 1000, 2000};
  expect_reason(result, RegistrationReason::underconstrained, "is one plane");
}

TEST(Reason, SeveralPoses) {
  RegistrationResult result = unsure();
  result.modes.push_back(result.modes.front());
  result.modes.back().confidence = 0.15;
  result.modes.push_back(result.modes.front());
  result.modes.back().confidence = 0.01;
  expect_reason(result, RegistrationReason::ambiguous,
                "2 poses compete, with confidences of 0.200, 0.150 (modes)");
  // Hopeless poses that are equally so are not several places.
  for (RegistrationMode& mode : result.modes) {
    mode.confidence *= 0.01;
    mode.evidence.source_overlap = mode.evidence.target_overlap = 0.1;
  }
  EXPECT_EQ(diagnose(result), RegistrationReason::too_little_overlap);
}

TEST(Reason, OutsideTheFittedRange) {
  RegistrationResult result = unsure();
  result.statistics.source_points = 714;
  expect_reason(result, RegistrationReason::outside_fitted_range, "714 and 6000 points");
  result.statistics.source_points = 150'000;
  expect_reason(result, RegistrationReason::outside_fitted_range, "150000 and 6000 points");
}

TEST(Reason, ScansOf2dScannersHaveFewPointsAndNothingAcross) {
  RegistrationResult result = unsure();
  result.flat = true;
  result.statistics.source_points = 280;
  result.modes.front().evidence.information_eigenvalues = {0, 0, 0, 500, 1000, 2000};
  EXPECT_EQ(diagnose(result), RegistrationReason::confidence_too_low);
}

TEST(Reason, EveryOneHasNameAndSentence) {
  for (int k = 0; k <= static_cast<int>(kLastRegistrationReason); ++k) {
    const auto reason = static_cast<RegistrationReason>(k);
    EXPECT_STRNE(to_string(reason), "unknown") << k;
    EXPECT_STRNE(explain(reason), "unknown") << k;
    RegistrationResult result;
    result.reason = reason;
    EXPECT_NE(explain(result), "") << k;
  }
}

}  // namespace
}  // namespace gpureg
