// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <sstream>
#include <string>

#include "gpureg/error.hpp"

namespace gpureg {

/// Largest difference of R R' from the identity. A float pose has 1e-6, one of four decimals 1e-4;
/// a scale, a shear or a mirror image has far more.
inline constexpr double kRigidTolerance = 1e-3;

/// Why a matrix is no rigid motion, as "its last row is ..."; empty: it is one. All 16 numbers
/// count: a matrix whose translation is in the last row has lost it otherwise.
inline std::string why_not_rigid(const Eigen::Matrix4d& m, double tolerance = kRigidTolerance) {
  std::ostringstream why;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      if (!std::isfinite(m(row, column)) && why.str().empty())
        why << "its element [" << row << ", " << column << "] is " << m(row, column)
            << ", expected a finite number";
  if (!m.allFinite()) return why.str();
  const Eigen::RowVector4d last(0, 0, 0, 1);
  constexpr double kLastRow = 1e-6;
  const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
  const double off = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  const bool rotation = off <= tolerance && r.determinant() > 0;
  if ((m.row(3) - last).cwiseAbs().maxCoeff() > kLastRow) {
    why << "its last row is [" << m(3, 0) << ", " << m(3, 1) << ", " << m(3, 2) << ", " << m(3, 3)
        << "], expected [0, 0, 0, 1]";
    if (rotation && m.col(3) == last.transpose()) why << "; it looks transposed";
  } else if (!rotation) {
    why << "its rotation R has determinant " << r.determinant()
        << ", and R R' is off the identity by " << off;
  }
  return why.str();
}

/// @throws InvalidArgument naming the pose and why it is no rigid motion.
template <typename Pose>
void require_rigid(const Pose& pose, const std::string& name) {
  const std::string why = why_not_rigid(pose.matrix());
  if (!why.empty()) throw InvalidArgument(name + " is no rigid motion: " + why);
}

}  // namespace gpureg
