// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "gpureg/result.hpp"

namespace gpureg {
namespace {

/// Poses under which fewer points overlap are correct less often than the regressions say
/// (bench/results/few_points.json).
constexpr std::uint32_t kFewPoints = 300;
/// Prepared points of the clouds that the regressions were fitted to have this order of magnitude.
constexpr std::uint32_t kFewestFitted = 1000, kMostFitted = 100'000;
/// What evaluations call an overlapping pair, and what hardly any correct pose is below.
constexpr double kOverlap = 0.3, kLeastOverlap = 0.1;
/// Of a hundred correct poses (house A, known viewpoints) one has more: 0.018 and 0.026. The second
/// is a sum of both sides and of near and far; scans without viewpoints reach 0.07.
constexpr double kFreeSpaceViolation = 0.03, kFrontViolation = 0.1;
/// Mean squared cosine of the inliers' normals with the weakest direction: 0.016 in a corridor of
/// bare walls, 0.19 in a furnished room.
constexpr double kSlidingCosine = 0.02;
/// An eigenvalue of the information below this share of the next ones stands for a free motion.
constexpr double kFreeMotion = 0.02;
/// Bushes, scanned twice: three quarters of the points are close, a tenth of these with a like
/// normal. Wrong poses of streets: half of the points, and four tenths of these.
constexpr double kCloseInClutter = 0.5, kAgreeingInClutter = 0.3;
/// Confidences of modes that compete, relative to the first one, and the sum from
/// which they tell more than anything else.
constexpr double kSimilarConfidence = 1.0 / 3.0, kAmbiguousTogether = 0.3;

double higher(double a, double b) { return std::max(a, b); }
double overlap_of(const PoseEvidence& e) { return higher(e.source_overlap, e.target_overlap); }
double close_of(const PoseEvidence& e) {
  return higher(e.source_overlap_any_normal, e.target_overlap_any_normal);
}
double violation_of(const PoseEvidence& e) {
  return higher(e.source_free_space_violation, e.target_free_space_violation);
}
double front_violation_of(const PoseEvidence& e) {
  return e.source_front_violation_near + e.source_front_violation_far +
         e.target_front_violation_near + e.target_front_violation_far;
}
bool observed(const PoseEvidence& e) { return e.source_observed > 0 || e.target_observed > 0; }

bool contradicts_free_space(const PoseEvidence& e) {
  return observed(e) ? violation_of(e) > kFreeSpaceViolation
                     : front_violation_of(e) > kFrontViolation;
}

enum class FreeMotion : std::uint8_t { none, in_plane, along, about };

Eigen::Vector3d rotation_of(const PoseEvidence& e) {
  return {e.weakest_direction[0], e.weakest_direction[1], e.weakest_direction[2]};
}
Eigen::Vector3d translation_of(const PoseEvidence& e) {
  return {e.weakest_direction[3], e.weakest_direction[4], e.weakest_direction[5]};
}

FreeMotion free_motion(const PoseEvidence& e, std::uint32_t inliers) {
  const auto& eigenvalue = e.information_eigenvalues;
  if (eigenvalue[2] <= kFreeMotion * eigenvalue[3]) return FreeMotion::in_plane;
  if (translation_of(e).norm() > rotation_of(e).norm())
    return eigenvalue[0] < kSlidingCosine * inliers ? FreeMotion::along : FreeMotion::none;
  return eigenvalue[0] < kFreeMotion * eigenvalue[1] ? FreeMotion::about : FreeMotion::none;
}

/// Confidences of the modes that compete with the first one, with that one.
std::vector<double> similar_confidences(const RegistrationResult& result) {
  std::vector<double> out;
  for (const RegistrationMode& mode : result.modes)
    if (mode.confidence > 0 &&
        mode.confidence >= kSimilarConfidence * result.modes.front().confidence)
      out.push_back(mode.confidence);
  return out;
}

double sum_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

std::string number(double value, const char* pattern) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}
std::string percent(double share) { return number(100 * share, share < 0.1 ? "%.1f" : "%.0f"); }
std::string direction(const Eigen::Vector3d& vector) {
  const Eigen::Vector3d v = vector.normalized();
  std::string text;
  for (int k = 0; k < 3; ++k)  // + 0.0: no "-0.00"
    text += (k == 0 ? "(" : ", ") + number(std::round(100 * v[k]) / 100 + 0.0, "%.2f");
  return text + ") in the target's frame";
}

std::string explain_few_points(const RegistrationStatistics& s) {
  const bool source = s.source_points <= s.target_points;
  return std::string("the ") + (source ? "source" : "target") + " has " +
         std::to_string(source ? s.source_points : s.target_points) +
         " points after downsampling: some pose fits so few to any other cloud";
}

std::string explain_free_motion(const PoseEvidence& e, std::uint32_t inliers) {
  const std::string begin = "what overlaps under the best pose found ";
  switch (free_motion(e, inliers)) {
    case FreeMotion::in_plane:
      return begin + "is one plane, in which the pose can slide and turn";
    case FreeMotion::along:
      return begin + "lets it slide along " + direction(translation_of(e));
    case FreeMotion::about:
      return begin + "lets it turn about " + direction(rotation_of(e));
    case FreeMotion::none:
      break;
  }
  return explain(RegistrationReason::underconstrained);
}

std::string explain_modes(const std::vector<double>& confidences) {
  constexpr std::size_t kListed = 4;
  std::string text = std::to_string(confidences.size()) + " poses compete, with confidences of ";
  for (std::size_t k = 0; k < std::min(kListed, confidences.size()); ++k)
    text += (k == 0 ? "" : ", ") + number(confidences[k], "%.3f");
  return text + (confidences.size() > kListed ? ", ..." : "") + " (modes)";
}

std::string explain_violation(const PoseEvidence& e) {
  if (!observed(e))
    return "under the best pose found, " +
           percent(higher(e.source_front_violation_near + e.source_front_violation_far,
                          e.target_front_violation_near + e.target_front_violation_far)) +
           " % of the points of a cloud hang in front of surfaces of the other one, where it "
           "should have seen them";
  return "under the best pose found, " + percent(violation_of(e)) +
         " % of the points in view of the other cloud's sensor lie where it saw free space";
}

std::string overlap_text(const PoseEvidence& e) {
  return percent(e.source_overlap) + " % of the source and " + percent(e.target_overlap) +
         " % of the target";
}

}  // namespace

RegistrationReason diagnose(const RegistrationResult& result) {
  const RegistrationStatistics& s = result.statistics;
  const auto [fewer, more] = std::minmax(s.source_points, s.target_points);
  // 2-D scans have few points, and nothing holds them across their plane, which is no lack.
  if (fewer < kFewPoints && !result.flat) return RegistrationReason::too_few_points;
  if (result.modes.empty() || s.inliers == 0) return RegistrationReason::no_candidate;
  const PoseEvidence& e = result.modes.front().evidence;
  const std::vector<double> similar = similar_confidences(result);
  if (similar.size() > 1 && sum_of(similar) >= kAmbiguousTogether)
    return RegistrationReason::ambiguous;
  const double overlap = overlap_of(e);
  if (close_of(e) > kCloseInClutter && overlap < kAgreeingInClutter * close_of(e))
    return RegistrationReason::clutter;
  if (overlap < kLeastOverlap) return RegistrationReason::too_little_overlap;
  // Wrong poses of clouds without overlap violate free space, too: there that is no cause.
  if (contradicts_free_space(e))
    return overlap < kOverlap ? RegistrationReason::too_little_overlap
                              : RegistrationReason::contradicts_free_space;
  if (!result.flat && free_motion(e, s.inliers) != FreeMotion::none)
    return RegistrationReason::underconstrained;
  if (overlap < kOverlap) return RegistrationReason::too_little_overlap;
  if (similar.size() > 1) return RegistrationReason::ambiguous;
  return !result.flat && (fewer < kFewestFitted || more > kMostFitted)
             ? RegistrationReason::outside_fitted_range
             : RegistrationReason::confidence_too_low;
}

std::string explain(const RegistrationResult& result) {
  const RegistrationStatistics& s = result.statistics;
  const bool no_source = result.reason == RegistrationReason::too_few_source_points;
  if (no_source || result.reason == RegistrationReason::too_few_target_points) {
    const std::uint32_t points = no_source ? s.source_points : s.target_points;
    return std::string("the ") + (no_source ? "source" : "target") + " has " +
           (points == 0 ? "no" : std::to_string(points)) +
           " usable points after downsampling, expected 4 or more";
  }
  if (result.reason == RegistrationReason::too_few_points) return explain_few_points(s);
  if (result.reason == RegistrationReason::outside_fitted_range)
    return "the clouds have " + std::to_string(s.source_points) + " and " +
           std::to_string(s.target_points) +
           " points after downsampling; the confidence was fitted to clouds of " +
           std::to_string(kFewestFitted) + " to " + std::to_string(kMostFitted);
  if (result.modes.empty()) return explain(result.reason);
  const PoseEvidence& e = result.modes.front().evidence;
  switch (result.reason) {
    case RegistrationReason::too_little_overlap:
      return "the best pose found brings only " + overlap_text(e) + " together";
    case RegistrationReason::clutter:
      return "under the best pose found, " + percent(close_of(e)) +
             " % of the points of a cloud are close to the other one, but only " +
             percent(overlap_of(e)) + " % with a like surface: vegetation, clutter or noise";
    case RegistrationReason::underconstrained:
      return explain_free_motion(e, s.inliers);
    case RegistrationReason::ambiguous:
      return explain_modes(similar_confidences(result));
    case RegistrationReason::contradicts_free_space:
      return explain_violation(e);
    case RegistrationReason::confidence_too_low:
      return "all of the evidence for the best pose found together is too weak: it brings " +
             overlap_text(e) + " together";
    default:
      return explain(result.reason);
  }
}

const char* advice(RegistrationReason reason) {
  switch (reason) {
    case RegistrationReason::too_few_source_points:
    case RegistrationReason::too_few_target_points:
    case RegistrationReason::too_few_points:
      return "a smaller voxel_size (is it in the unit of the points?), or a larger part of the "
             "cloud";
    case RegistrationReason::no_usable_features:
      return "a larger voxel_size, if the cloud is sparser than it; lines and single points cannot "
             "be aligned";
    case RegistrationReason::no_hypothesis_survived:
    case RegistrationReason::inlier_ratio_too_low:
      return "the default method, or a larger quadruples.count";
    case RegistrationReason::degenerate_geometry:
    case RegistrationReason::no_candidate:
      return "are both clouds of one place and in one unit? Then another voxel_size";
    case RegistrationReason::contradicts_prior:
      return "a wider prior, or the up of each cloud in its own frame";
    case RegistrationReason::too_little_overlap:
      return "clouds that show more of the same place, or a higher quality";
    case RegistrationReason::underconstrained:
      return "larger clouds that hold the pose: corners, ends, furniture; or a RegistrationPrior";
    case RegistrationReason::symmetric:
      return "accept_symmetry, if any of the equivalent poses will do";
    case RegistrationReason::ambiguous:
      return "a RegistrationPrior, larger clouds, or loop_consistency() with the other pairs of a "
             "set";
    case RegistrationReason::contradicts_free_space:
      return "are the clouds of one place, and did nothing move? Then check the viewpoints, and "
             "that normals point to the sensor";
    case RegistrationReason::clutter:
      return "a larger voxel_size, which averages what is small, or clouds with more walls and "
             "ground";
    case RegistrationReason::outside_fitted_range:
      return "suggest_voxel_size(), or a calibration to your sensor";
    case RegistrationReason::confidence_too_low:
      return "find(), if one of the clouds is a part of the other; a calibration to your sensor, "
             "or "
             "a lower min_confidence";
    case RegistrationReason::flat_with_solid:
      return "the points at the scanner's height, cut out of the cloud that is not flat";
    case RegistrationReason::contradicts_loops:
    case RegistrationReason::none:
    case RegistrationReason::cancelled:
      break;
  }
  return "";
}

}  // namespace gpureg
