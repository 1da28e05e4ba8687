// SPDX-License-Identifier: BSD-3-Clause
#include "confidence/information.hpp"

#include <algorithm>
#include <iterator>
#include <numeric>

#include "math/jacobi.hpp"

namespace gpureg::confidence {
namespace {

/// Rotations count by the displacement that they cause at this distance: twenty voxels, a metre at
/// the default voxel size.
double unit_length(const PrepareOptions& options) {
  const double voxel = options.voxel_size > 0
                           ? static_cast<double>(options.voxel_size)
                           : static_cast<double>(options.max_correspondence_distance) / 1.5;
  return 20.0 * voxel;
}

/// Twice what 6 x 6 matrices need: the off-diagonal shrinks quadratically from the fourth on.
constexpr int kSweeps = 12;

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
  // The project's own solver: Eigen's differs between its versions in the last bits.
  double values[6][6], vectors[6][6];
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) values[i][j] = centred(i, j);
  jacobi_eigen<6, kSweeps>(values, vectors);
  int order[6];
  std::iota(std::begin(order), std::end(order), 0);
  std::stable_sort(std::begin(order), std::end(order),
                   [&](int i, int j) { return values[i][i] < values[j][j]; });
  InformationSpectrum out;
  out.centre = c * radius;
  out.unit = unit;
  for (int k = 0; k < 6; ++k) {
    out.eigenvalues[k] = values[order[k]][order[k]];
    out.weakest_direction[k] = vectors[k][order[0]];
  }
  return out;
}

}  // namespace gpureg::confidence
