// SPDX-License-Identifier: BSD-3-Clause
#include "confidence/information.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>

#include "math/jacobi_lanes.hpp"

namespace gpureg::confidence {
namespace {

/// Rotations count by the displacement that they cause at this distance: twenty voxels, a metre at
/// the default voxel size.
double unit_length(const PrepareSettings& options) {
  const double voxel = options.voxel_size > 0
                           ? static_cast<double>(options.voxel_size)
                           : static_cast<double>(options.max_correspondence_distance) / 1.5;
  return 20.0 * voxel;
}

/// Twice what 6 x 6 matrices need: the off-diagonal shrinks quadratically from the fourth on.
constexpr int kSweeps = 12;

/// The information of a mode, about the centre of its inliers.
Eigen::Matrix<double, 6, 6> centred_information(const ModeOutcome& mode, const PreparedState& moved,
                                                InformationSpectrum& out) {
  const double fixed = 1.0 / static_cast<double>(kIcpFixedScale),
               radius = static_cast<double>(moved.radius);
  const InformationSums& sums = mode.information;
  Eigen::Matrix<double, 6, 6> a, turn = Eigen::Matrix<double, 6, 6>::Identity();
  for (int i = 0, k = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j, ++k) a(i, j) = a(j, i) = static_cast<double>(sums.v[k]) * fixed;
  // Arms about the centre of the inliers, in the unit: (arm - c) x n = arm x n - c x n.
  const double unit = unit_length(moved.options), scale = radius / unit;
  Eigen::Vector3d c = Eigen::Vector3d::Zero();
  if (mode.source[Term::inliers] > 0)
    for (int k = 0; k < 3; ++k)
      c[k] = static_cast<double>(sums.arm[k]) * fixed / mode.source.points(Term::inliers);
  Eigen::Matrix3d cross;
  cross << 0, -c.z(), c.y(), c.z(), 0, -c.x(), -c.y(), c.x(), 0;
  turn.topLeftCorner<3, 3>() *= scale;
  turn.topRightCorner<3, 3>() = -scale * cross;
  out.centre = c * radius;
  out.unit = unit;
  return turn * a * turn.transpose();
}

/// Restricts the information to the motions in the plane. Those out of it, which the layers of a
/// 2-D scan hardly hold, are given more than any of these.
void hold_in_plane(const ScanPlane& plane, Eigen::Matrix<double, 6, 6>& information) {
  const Eigen::Vector3d n(plane.normal[0], plane.normal[1], plane.normal[2]);
  Eigen::Matrix<double, 6, 6> in_plane = Eigen::Matrix<double, 6, 6>::Zero();
  in_plane.topLeftCorner<3, 3>() = n * n.transpose();
  in_plane.bottomRightCorner<3, 3>() = Eigen::Matrix3d::Identity() - n * n.transpose();
  const Eigen::Matrix<double, 6, 6> held = in_plane * information * in_plane;
  information = held + (1 + held.trace()) * (Eigen::Matrix<double, 6, 6>::Identity() - in_plane);
}

/// The project's own solver: Eigen's differs between its versions in the last bits.
void decompose(const std::vector<Eigen::Matrix<double, 6, 6>>& matrices, std::size_t first,
               std::size_t count, std::vector<InformationSpectrum>& out) {
  Matrices6 values{}, vectors;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      for (std::size_t l = 0; l < count; ++l) values.at[i][j][l] = matrices[first + l](i, j);
  jacobi_eigen(kSweeps, values, vectors);
  for (std::size_t l = 0; l < count; ++l) {
    int order[6];
    std::iota(std::begin(order), std::end(order), 0);
    std::stable_sort(std::begin(order), std::end(order),
                     [&](int i, int j) { return values.at[i][i][l] < values.at[j][j][l]; });
    for (int k = 0; k < 6; ++k) {
      out[first + l].eigenvalues[k] = values.at[order[k]][order[k]][l];
      out[first + l].weakest_direction[k] = vectors.at[k][order[0]][l];
    }
  }
}

}  // namespace

std::vector<InformationSpectrum> spectra_of(const std::vector<const ModeOutcome*>& modes,
                                            const PreparedState& moved,
                                            const PreparedState& fixed) {
  std::vector<InformationSpectrum> out(modes.size());
  std::vector<Eigen::Matrix<double, 6, 6>> matrices;
  for (std::size_t k = 0; k < modes.size(); ++k)
    matrices.push_back(centred_information(*modes[k], moved, out[k]));
  if (planar_pair(moved, fixed))
    for (auto& matrix : matrices) hold_in_plane(fixed.plane, matrix);
  for (std::size_t first = 0; first < modes.size(); first += Matrices6::kLanes)
    decompose(matrices, first, std::min<std::size_t>(Matrices6::kLanes, modes.size() - first), out);
  return out;
}

}  // namespace gpureg::confidence
