// SPDX-License-Identifier: BSD-3-Clause
#include "confidence/pose_evidence.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace gpureg::confidence {
namespace {

double share(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

double residual(const SideEvidence& side) {
  return side.inliers > 0 ? std::sqrt(static_cast<double>(side.residual) /
                                      static_cast<double>(kResidualScale) / side.inliers)
                          : 1.0;
}

double incidence_share(const SideEvidence& side) {
  return share(side.incidence_observed, side.tested) / static_cast<double>(kIncidenceScale);
}

}  // namespace

PoseEvidence evidence_of(const PairOutcome& outcome, const ModeOutcome& mode,
                         const InformationSpectrum& spectrum, const PreparedState& moved,
                         const PreparedState& fixed, bool swapped) {
  const SideEvidence &s = swapped ? mode.target : mode.source,
                     &t = swapped ? mode.source : mode.target;
  const std::uint64_t whole_s = swapped ? fixed.normal_weight_total : moved.normal_weight_total,
                      whole_t = swapped ? moved.normal_weight_total : fixed.normal_weight_total;
  PoseEvidence e;
  e.match_inliers = mode.matches.inliers;
  e.match_support = std::min(share(mode.matches.source_weight, outcome.match_weight_source),
                             share(mode.matches.target_weight, outcome.match_weight_target));
  e.source_overlap = share(s.inliers, s.tested);
  e.target_overlap = share(t.inliers, t.tested);
  e.source_overlap_any_normal = share(s.hits, s.tested);
  e.target_overlap_any_normal = share(t.hits, t.tested);
  e.source_residual = residual(s);
  e.target_residual = residual(t);
  e.source_normal_weighted_overlap = share(s.normal_weighted, whole_s);
  e.target_normal_weighted_overlap = share(t.normal_weighted, whole_t);
  e.source_observed = incidence_share(s);
  e.target_observed = incidence_share(t);
  e.source_free_space_violation = share(s.incidence_violating, s.incidence_observed);
  e.target_free_space_violation = share(t.incidence_violating, t.incidence_observed);
  e.source_occluded = share(s.occluded, s.observed);
  e.target_occluded = share(t.occluded, t.observed);
  e.source_near_surface = share(s.near_surface, s.tested);
  e.target_near_surface = share(t.near_surface, t.tested);
  e.source_front_violation_near = share(s.front_violation_near, s.tested);
  e.target_front_violation_near = share(t.front_violation_near, t.tested);
  e.source_front_violation_far = share(s.front_violation_far, s.tested);
  e.target_front_violation_far = share(t.front_violation_far, t.tested);
  e.source_behind_surface = share(s.behind_surface, s.tested);
  e.target_behind_surface = share(t.behind_surface, t.tested);
  const Eigen::Matrix3d fixed_from_moved =
      Eigen::Quaterniond(mode.pose.w, mode.pose.x, mode.pose.y, mode.pose.z)
          .normalized()
          .toRotationMatrix();
  Eigen::Matrix<double, 6, 1> weakest = spectrum.weakest_direction;
  if (swapped) {
    weakest.head<3>() = fixed_from_moved.transpose() * weakest.head<3>().eval();
    weakest.tail<3>() = fixed_from_moved.transpose() * weakest.tail<3>().eval();
  }
  if (planar_pair(moved, fixed)) {
    // The pose of the engine is planar but for its last digits.
    const ScanPlane& plane = swapped ? moved.plane : fixed.plane;
    const Eigen::Vector3d n(plane.normal[0], plane.normal[1], plane.normal[2]);
    weakest.head<3>() = n * n.dot(weakest.head<3>());
    weakest.tail<3>() -= n * n.dot(weakest.tail<3>());
  }
  Eigen::Index largest = 0;
  weakest.cwiseAbs().maxCoeff(&largest);
  if (weakest[largest] < 0) weakest = -weakest;
  for (int k = 0; k < 6; ++k) {
    e.information_eigenvalues[static_cast<std::size_t>(k)] = std::max(0.0, spectrum.eigenvalues[k]);
    e.weakest_direction[static_cast<std::size_t>(k)] = weakest[k];
  }
  return e;
}

}  // namespace gpureg::confidence
