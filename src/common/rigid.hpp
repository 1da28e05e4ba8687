// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string>

#include "common/coordinates.hpp"
#include "common/shown.hpp"
#include "gpureg/error.hpp"

namespace gpureg {

/// Largest difference of R R' from the identity. A float pose has 1e-6, one of four decimals 1e-4;
/// a scale, a shear or a mirror image has far more.
inline constexpr double kRigidTolerance = 1e-3;

/// Why a matrix is no rigid motion, as "its last row is ..."; empty: it is one. All 16 numbers
/// count: a matrix whose translation is in the last row has lost it otherwise.
inline std::string why_not_rigid(const Eigen::Matrix4d& m, double tolerance = kRigidTolerance) {
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      if (!std::isfinite(m(row, column)))
        return "its element [" + std::to_string(row) + ", " + std::to_string(column) + "] is " +
               shown(m(row, column)) + ", expected a finite number";
  const Eigen::RowVector4d last(0, 0, 0, 1);
  constexpr double kLastRow = 1e-6;
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  const double off = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const auto minor = [&](int i, int j) { return r(1, i) * r(2, j) - r(1, j) * r(2, i); };
  const double determinant = r(0, 0) * minor(1, 2) - r(0, 1) * minor(0, 2) + r(0, 2) * minor(0, 1);
  const bool rotation = off <= tolerance && determinant > 0;
  if ((m.row(3) - last).cwiseAbs().maxCoeff() > kLastRow) {
    std::string row;
    for (int k = 0; k < 4; ++k) row += (k > 0 ? ", " : "") + shown(m(3, k), 6);
    const bool transposed = rotation && m.col(3) == last.transpose();
    return "its last row is [" + row + "], expected [0, 0, 0, 1]" +
           (transposed ? "; it looks transposed" : "");
  }
  const double farthest = m.topRightCorner<3, 1>().cwiseAbs().maxCoeff();
  if (farthest > limits::kMaxCoordinate)
    return "its translation reaches " + shown(farthest) + ", expected at most 1e12";
  if (rotation) return {};
  return "its rotation R has determinant " + shown(determinant, 6) +
         ", and R R' is off the identity by " + shown(off, 6);
}

/// @throws InvalidArgument naming the pose and why it is no rigid motion.
template <typename Pose>
void require_rigid(const Pose& pose, const std::string& name) {
  const std::string why = why_not_rigid(pose.matrix());
  if (!why.empty()) throw InvalidArgument(name + " is no rigid motion: " + why);
}

}  // namespace gpureg
