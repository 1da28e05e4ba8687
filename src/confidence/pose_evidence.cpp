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

double share(const SideEvidence& side, Term part, Term whole) {
  return share(static_cast<std::uint64_t>(side[part]), static_cast<std::uint64_t>(side[whole]));
}

double residual(const SideEvidence& side) {
  const std::uint32_t inliers = side.points(Term::inliers);
  return inliers > 0 ? std::sqrt(static_cast<double>(side[Term::residual]) /
                                 static_cast<double>(kResidualScale) / inliers)
                     : 1.0;
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
  // Share of `part` in `whole`, of both sides.
  const auto shares = [&](double& source, double& target, Term part, Term whole = Term::tested) {
    source = share(s, part, whole);
    target = share(t, part, whole);
  };
  shares(e.source_overlap, e.target_overlap, Term::inliers);
  shares(e.source_overlap_any_normal, e.target_overlap_any_normal, Term::hits);
  shares(e.source_observed, e.target_observed, Term::incidence_observed);
  e.source_observed /= static_cast<double>(kIncidenceScale);
  e.target_observed /= static_cast<double>(kIncidenceScale);
  shares(e.source_free_space_violation, e.target_free_space_violation, Term::incidence_violating,
         Term::incidence_observed);
  shares(e.source_occluded, e.target_occluded, Term::occluded, Term::observed);
  shares(e.source_near_surface, e.target_near_surface, Term::near_surface);
  shares(e.source_front_violation_near, e.target_front_violation_near, Term::front_violation_near);
  shares(e.source_front_violation_far, e.target_front_violation_far, Term::front_violation_far);
  shares(e.source_behind_surface, e.target_behind_surface, Term::behind_surface);
  e.source_normal_weighted_overlap =
      share(static_cast<std::uint64_t>(s[Term::normal_weighted]), whole_s);
  e.target_normal_weighted_overlap =
      share(static_cast<std::uint64_t>(t[Term::normal_weighted]), whole_t);
  e.source_residual = residual(s);
  e.target_residual = residual(t);
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
