// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "pipeline/prepared_state.hpp"

namespace gpureg::confidence {

/// How well the inliers of a mode determine it: eigen-decomposition of the point-to-plane
/// information about their centre, rotation before translation. Directions are in the fixed cloud's
/// frame.
struct InformationSpectrum {
  Eigen::Vector3d centre;  ///< of the inliers, from the moved cloud's local origin
  double unit;             ///< length at which rotations count, see information.cpp
  Eigen::Matrix<double, 6, 1> eigenvalues;        ///< ascending
  Eigen::Matrix<double, 6, 1> weakest_direction;  ///< unit eigenvector of the first
};

/// Of 2-D scans the first three are of the motions in the plane; those out of it are held firmly.
std::vector<InformationSpectrum> spectra_of(const std::vector<const ModeOutcome*>& modes,
                                            const PreparedState& moved, const PreparedState& fixed);

}  // namespace gpureg::confidence
