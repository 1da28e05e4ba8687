// SPDX-License-Identifier: BSD-3-Clause
#include "api/evidence.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace gpureg {
namespace {

double share(std::uint64_t part, std::uint64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

double residual(const SideEvidence& side) {
  return side.inliers > 0 ? std::sqrt(static_cast<double>(side.residual) /
                                      static_cast<double>(kResidualScale) / side.inliers)
                          : 1.0;
}

double facing_share(const SideEvidence& side) {
  return share(side.facing_seen, side.tested) / static_cast<double>(kFacingScale);
}

/// The length that rotations are measured at: twenty voxels, a metre at the usual five centimetres.
double unit_length(const PrepareOptions& options) {
  const double voxel = options.voxel_size > 0 ? static_cast<double>(options.voxel_size)
                                              : static_cast<double>(options.search_distance) / 1.5;
  return 20.0 * voxel;
}

}  // namespace

InformationSpectrum spectrum_of(const ModeOutcome& mode, const PreparedState& moved) {
  const double fixed = 1.0 / static_cast<double>(kIcpFixedScale),
               radius = static_cast<double>(moved.radius);
  const InformationSums& sums = mode.information;
  Eigen::Matrix<double, 6, 6> a, turn = Eigen::Matrix<double, 6, 6>::Identity();
  for (int i = 0, k = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j, ++k) a(i, j) = a(j, i) = static_cast<double>(sums.v[k]) * fixed;
  // Arms about the centre of the inliers, in the unit: (arm - c) x n = arm x n - c x n.
  const double unit = unit_length(moved.options), scale = radius / unit;
  Eigen::Vector3d c = Eigen::Vector3d::Zero();
  if (mode.source.inliers > 0)
    for (int k = 0; k < 3; ++k)
      c[k] = static_cast<double>(sums.arm[k]) * fixed / mode.source.inliers;
  Eigen::Matrix3d cross;
  cross << 0, -c.z(), c.y(), c.z(), 0, -c.x(), -c.y(), c.x(), 0;
  turn.topLeftCorner<3, 3>() *= scale;
  turn.topRightCorner<3, 3>() = -scale * cross;
  const Eigen::Matrix<double, 6, 6> centred = turn * a * turn.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(centred);
  InformationSpectrum out;
  out.centre = c * radius;
  out.unit = unit;
  out.values = solver.eigenvalues();
  out.softest = solver.eigenvectors().col(0);
  return out;
}

PoseEvidence to_evidence(const PairOutcome& outcome, const ModeOutcome& mode,
                         const PreparedState& moved, const PreparedState& fixed, bool swapped) {
  const SideEvidence &s = swapped ? mode.target : mode.source,
                     &t = swapped ? mode.source : mode.target;
  const std::uint64_t whole_s = swapped ? fixed.balance_total : moved.balance_total,
                      whole_t = swapped ? moved.balance_total : fixed.balance_total;
  PoseEvidence e;
  e.match_inliers = mode.matches.inliers;
  e.match_support = std::min(share(mode.matches.source_weight, outcome.match_weight_source),
                             share(mode.matches.target_weight, outcome.match_weight_target));
  e.source_overlap = share(s.inliers, s.tested);
  e.target_overlap = share(t.inliers, t.tested);
  e.source_reach = share(s.hits, s.tested);
  e.target_reach = share(t.hits, t.tested);
  e.source_residual = residual(s);
  e.target_residual = residual(t);
  e.source_balanced_overlap = share(s.balanced, whole_s);
  e.target_balanced_overlap = share(t.balanced, whole_t);
  e.source_seen = facing_share(s);
  e.target_seen = facing_share(t);
  e.source_impossible = share(s.facing_before, s.facing_seen);
  e.target_impossible = share(t.facing_before, t.facing_seen);
  e.source_hidden = share(s.hidden, s.seen);
  e.target_hidden = share(t.hidden, t.seen);
  e.source_around = share(s.around, s.tested);
  e.target_around = share(t.around, t.tested);
  e.source_near_front = share(s.near_front, s.tested);
  e.target_near_front = share(t.near_front, t.tested);
  e.source_far_front = share(s.far_front, s.tested);
  e.target_far_front = share(t.far_front, t.tested);
  e.source_at_back = share(s.at_back, s.tested);
  e.target_at_back = share(t.at_back, t.tested);
  const Eigen::Matrix3d fixed_from_moved =
      Eigen::Quaterniond(mode.pose.w, mode.pose.x, mode.pose.y, mode.pose.z)
          .normalized()
          .toRotationMatrix();
  const InformationSpectrum spectrum = spectrum_of(mode, moved);
  Eigen::Matrix<double, 6, 1> soft = spectrum.softest;
  if (swapped)
    soft.head<3>() = fixed_from_moved.transpose() * soft.head<3>().eval(),
    soft.tail<3>() = fixed_from_moved.transpose() * soft.tail<3>().eval();
  Eigen::Index largest = 0;
  soft.cwiseAbs().maxCoeff(&largest);
  if (soft[largest] < 0) soft = -soft;
  for (int k = 0; k < 6; ++k) {
    e.stiffness[static_cast<std::size_t>(k)] = std::max(0.0, spectrum.values[k]);
    e.softest[static_cast<std::size_t>(k)] = soft[k];
  }
  return e;
}

}  // namespace gpureg
