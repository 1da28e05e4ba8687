// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/result.hpp"

#include <algorithm>
#include <cmath>

namespace gpureg {

const char* to_string(RegistrationStatus status) {
  switch (status) {
    case RegistrationStatus::aligned:
      return "aligned";
    case RegistrationStatus::aligned_up_to_symmetry:
      return "aligned_up_to_symmetry";
    case RegistrationStatus::not_aligned:
      return "not_aligned";
    case RegistrationStatus::skipped:
      return "skipped";
  }
  return "unknown";
}

const char* to_string(RegistrationReason reason) {
  switch (reason) {
    case RegistrationReason::none:
      return "none";
    case RegistrationReason::too_few_source_points:
      return "too_few_source_points";
    case RegistrationReason::too_few_target_points:
      return "too_few_target_points";
    case RegistrationReason::no_usable_features:
      return "no_usable_features";
    case RegistrationReason::no_hypothesis_survived:
      return "no_hypothesis_survived";
    case RegistrationReason::degenerate_geometry:
      return "degenerate_geometry";
    case RegistrationReason::inlier_ratio_too_low:
      return "inlier_ratio_too_low";
    case RegistrationReason::confidence_too_low:
      return "confidence_too_low";
    case RegistrationReason::symmetric:
      return "symmetric";
    case RegistrationReason::flat_with_solid:
      return "flat_with_solid";
    case RegistrationReason::contradicts_prior:
      return "contradicts_prior";
    case RegistrationReason::no_candidate:
      return "no_candidate";
    case RegistrationReason::too_few_points:
      return "too_few_points";
    case RegistrationReason::too_little_overlap:
      return "too_little_overlap";
    case RegistrationReason::underconstrained:
      return "underconstrained";
    case RegistrationReason::ambiguous:
      return "ambiguous";
    case RegistrationReason::contradicts_free_space:
      return "contradicts_free_space";
    case RegistrationReason::clutter:
      return "clutter";
    case RegistrationReason::outside_fitted_range:
      return "outside_fitted_range";
    case RegistrationReason::contradicts_loops:
      return "contradicts_loops";
    case RegistrationReason::cancelled:
      return "cancelled";
  }
  return "unknown";
}

const char* to_string(ViewpointSource source) {
  switch (source) {
    case ViewpointSource::given:
      return "given";
    case ViewpointSource::origin:
      return "origin";
    case ViewpointSource::normals:
      return "normals";
    case ViewpointSource::none:
      return "none";
    case ViewpointSource::model:
      return "model";
  }
  return "unknown";
}

const char* explain(ViewpointSource source) {
  switch (source) {
    case ViewpointSource::given:
      return "given";
    case ViewpointSource::origin:
      return "the origin, which the surfaces agree with";
    case ViewpointSource::normals:
      return "unknown; the normals tell the sides of surfaces";
    case ViewpointSource::none:
      return "unknown; both sides of surfaces are tried, free space is not used";
    case ViewpointSource::model:
      return "none; a closed surface, whose normals point outwards";
  }
  return "unknown";
}

const char* explain(RegistrationReason reason) {
  switch (reason) {
    case RegistrationReason::none:
      return "the clouds were aligned";
    case RegistrationReason::too_few_source_points:
      return "the source has fewer than 4 usable points after downsampling";
    case RegistrationReason::too_few_target_points:
      return "the target has fewer than 4 usable points after downsampling";
    case RegistrationReason::no_usable_features:
      return "fewer than 4 points could be matched: too few have a normal and neighbours";
    case RegistrationReason::no_hypothesis_survived:
      return "no quadruple of matches had similar side lengths in both clouds";
    case RegistrationReason::degenerate_geometry:
      return "no pose is determined: what matches is collinear or coincident";
    case RegistrationReason::inlier_ratio_too_low:
      return "the best pose found brings too few points together";
    case RegistrationReason::confidence_too_low:
      return "all of the evidence for the best pose found together is too weak";
    case RegistrationReason::symmetric:
      return "a symmetry makes several poses equivalent; one of them is most likely correct";
    case RegistrationReason::flat_with_solid:
      return "one cloud is a scan of a 2-D scanner and the other one is not; cut the points at the "
             "height of the 2-D scanner out of the other one";
    case RegistrationReason::contradicts_prior:
      return "every pose found contradicts what is known of gravity or of the pose";
    case RegistrationReason::no_candidate:
      return "no pose brings points of both clouds together";
    case RegistrationReason::too_few_points:
      return "a cloud has so few points after downsampling that some pose fits any other cloud";
    case RegistrationReason::too_little_overlap:
      return "the clouds overlap too little under the best pose found";
    case RegistrationReason::underconstrained:
      return "what overlaps leaves a motion free, as one plane or a bare corridor does";
    case RegistrationReason::ambiguous:
      return "several poses fit about equally well";
    case RegistrationReason::contradicts_free_space:
      return "under the best pose found, points lie where the other cloud observed free space";
    case RegistrationReason::clutter:
      return "points of both clouds are close, but their surfaces differ: vegetation or noise";
    case RegistrationReason::outside_fitted_range:
      return "the confidence was not fitted to clouds of this size";
    case RegistrationReason::contradicts_loops:
      return "the other pairs of the set contradict the best pose found";
    case RegistrationReason::cancelled:
      return "the batch was cancelled before this pair";
  }
  return "unknown";
}

std::size_t RegistrationResult::equivalent_poses() const {
  std::size_t count = modes.empty() ? 0 : 1;
  for (const RegistrationMode& mode : modes) count += mode.equivalent;
  return count;
}

double RegistrationResult::symmetry_confidence() const {
  if (modes.empty()) return confidence;
  double sum = modes.front().confidence;
  for (const RegistrationMode& mode : modes)
    if (mode.equivalent) sum += mode.confidence;
  return sum;
}

namespace {
Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}
}  // namespace

// Sum of A'A with A = [I | -s [p]x]: the translation block is count I, the mixed block -s [sum p]x,
// the rotation block s^2 (trace(P) I - P) with P = sum p p'.
Eigen::Matrix<double, 6, 6> CorrespondenceMoments::information_redwood() const {
  Eigen::Matrix<double, 6, 6> m;
  m.topLeftCorner<3, 3>() = static_cast<double>(count) * Eigen::Matrix3d::Identity();
  m.topRightCorner<3, 3>() = -2.0 * skew(sum);
  m.bottomLeftCorner<3, 3>() = m.topRightCorner<3, 3>().transpose();
  m.bottomRightCorner<3, 3>() = 4.0 * (outer.trace() * Eigen::Matrix3d::Identity() - outer);
  return m;
}

CorrespondenceMoments CorrespondenceMoments::from_redwood(
    const Eigen::Matrix<double, 6, 6>& information) {
  CorrespondenceMoments moments;
  moments.count = static_cast<std::uint64_t>(std::max(0.0, std::round(information(0, 0))));
  const Eigen::Matrix3d cross = information.topRightCorner<3, 3>() / -2;
  moments.sum = {cross(2, 1), cross(0, 2), cross(1, 0)};
  const Eigen::Matrix3d turn = information.bottomRightCorner<3, 3>() / 4;
  moments.outer = 0.5 * turn.trace() * Eigen::Matrix3d::Identity() - turn;
  return moments;
}

Eigen::Matrix<double, 6, 6> CorrespondenceMoments::information_open3d() const {
  Eigen::Matrix<double, 6, 6> m;
  m.topLeftCorner<3, 3>() = outer.trace() * Eigen::Matrix3d::Identity() - outer;
  m.topRightCorner<3, 3>() = skew(sum);
  m.bottomLeftCorner<3, 3>() = m.topRightCorner<3, 3>().transpose();
  m.bottomRightCorner<3, 3>() = static_cast<double>(count) * Eigen::Matrix3d::Identity();
  return m;
}

}  // namespace gpureg
