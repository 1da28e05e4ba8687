// SPDX-License-Identifier: BSD-3-Clause
#include "api/evidence.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace gpureg {
namespace {

double share(std::uint64_t part, std::uint64_t whole) { return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0; }

double residual(const SideEvidence& side) {
  return side.inliers > 0 ? std::sqrt(static_cast<double>(side.residual) / static_cast<double>(kResidualScale) / side.inliers) : 1.0;
}

/// The length that rotations are measured at: twenty voxels, a metre at the usual five centimetres.
double unit_length(const PrepareOptions& options) {
  const double voxel = options.voxel_size > 0 ? static_cast<double>(options.voxel_size) : static_cast<double>(options.search_distance) / 1.5;
  return 20.0 * voxel;
}

/// Eigenvalues of the information, ascending, and the direction of the smallest, its larger end positive.
struct Stiffness {
  std::array<double, 6> values{}, softest{};
};

Stiffness stiffness(const InformationSums& sums, std::uint32_t inliers, double radius, double unit, const Eigen::Matrix3d& target_from_fixed) {
  const double fixed = 1.0 / static_cast<double>(kIcpFixedScale);
  Eigen::Matrix<double, 6, 6> a, turn = Eigen::Matrix<double, 6, 6>::Identity();
  for (int i = 0, k = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j, ++k) a(i, j) = a(j, i) = static_cast<double>(sums.v[k]) * fixed;
  // Arms about the centre of the inliers, in the unit: (arm - c) x n = arm x n - c x n.
  const double scale = radius / unit;
  Eigen::Vector3d c = Eigen::Vector3d::Zero();
  if (inliers > 0)
    for (int k = 0; k < 3; ++k) c[k] = static_cast<double>(sums.arm[k]) * fixed / inliers;
  Eigen::Matrix3d cross;
  cross << 0, -c.z(), c.y(), c.z(), 0, -c.x(), -c.y(), c.x(), 0;
  turn.topLeftCorner<3, 3>() *= scale;
  turn.topRightCorner<3, 3>() = -scale * cross;
  const Eigen::Matrix<double, 6, 6> centred = turn * a * turn.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(centred);
  Eigen::Matrix<double, 6, 1> soft = solver.eigenvectors().col(0);
  soft.head<3>() = target_from_fixed * soft.head<3>().eval(), soft.tail<3>() = target_from_fixed * soft.tail<3>().eval();
  Eigen::Index largest = 0;
  soft.cwiseAbs().maxCoeff(&largest);
  if (soft[largest] < 0) soft = -soft;
  Stiffness out;
  for (int k = 0; k < 6; ++k) {
    out.values[static_cast<std::size_t>(k)] = std::max(0.0, solver.eigenvalues()[k]);
    out.softest[static_cast<std::size_t>(k)] = soft[k];
  }
  return out;
}

}  // namespace

PoseEvidence to_evidence(const PairOutcome& outcome, const ModeOutcome& mode, const PreparedState& moved, const PreparedState& fixed,
                         bool swapped) {
  const SideEvidence &s = swapped ? mode.target : mode.source, &t = swapped ? mode.source : mode.target;
  const std::uint64_t whole_s = swapped ? fixed.balance_total : moved.balance_total, whole_t = swapped ? moved.balance_total : fixed.balance_total;
  PoseEvidence e;
  e.match_inliers = mode.matches.inliers;
  e.match_support = std::min(share(mode.matches.source_weight, outcome.match_weight_source), share(mode.matches.target_weight, outcome.match_weight_target));
  e.source_overlap = share(s.inliers, s.tested), e.target_overlap = share(t.inliers, t.tested);
  e.source_reach = share(s.hits, s.tested), e.target_reach = share(t.hits, t.tested);
  e.source_residual = residual(s), e.target_residual = residual(t);
  e.source_balanced_overlap = share(s.balanced, whole_s), e.target_balanced_overlap = share(t.balanced, whole_t);
  e.source_seen = share(s.seen, s.tested), e.target_seen = share(t.seen, t.tested);
  e.source_impossible = share(s.before, s.seen), e.target_impossible = share(t.before, t.seen);
  e.source_hidden = share(s.hidden, s.seen), e.target_hidden = share(t.hidden, t.seen);
  e.source_around = share(s.around, s.tested), e.target_around = share(t.around, t.tested);
  e.source_near_front = share(s.near_front, s.tested), e.target_near_front = share(t.near_front, t.tested);
  e.source_far_front = share(s.far_front, s.tested), e.target_far_front = share(t.far_front, t.tested);
  e.source_at_back = share(s.at_back, s.tested), e.target_at_back = share(t.at_back, t.tested);
  const Eigen::Matrix3d fixed_from_moved = Eigen::Quaterniond(mode.pose.w, mode.pose.x, mode.pose.y, mode.pose.z).normalized().toRotationMatrix();
  const Stiffness stiff = stiffness(mode.information, mode.source.inliers, static_cast<double>(moved.radius), unit_length(moved.options),
                                    swapped ? Eigen::Matrix3d(fixed_from_moved.transpose()) : Eigen::Matrix3d::Identity());
  e.stiffness = stiff.values, e.softest = stiff.softest;
  return e;
}

}  // namespace gpureg
