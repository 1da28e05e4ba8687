// SPDX-License-Identifier: BSD-3-Clause
#include "reconstruction/edge_noise.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "pose_graph/se3.hpp"

namespace gpureg::reconstruction {
namespace {

using pose_graph::Matrix6d;
using pose_graph::Vector6d;

double square(double v) { return v * v; }

/// Variance factor of a direction with eigenvalue `weak`, relative to a typical direction.
double inflation(double weak, double typical, double most) {
  if (!(typical > 0)) return 1;
  return weak > typical / most ? std::max(1.0, typical / weak) : most;
}

/// Covariance at the centre of the overlap, rotation first, axes of the target.
Matrix6d covariance_at_centre(const PoseEvidence& evidence, const EdgeNoiseOptions& noise,
                              double unit, bool flat) {
  Matrix6d covariance = Matrix6d::Zero();
  covariance.topLeftCorner<3, 3>().diagonal().setConstant(square(noise.rotation * M_PI / 180));
  covariance.bottomRightCorner<3, 3>().diagonal().setConstant(square(noise.translation));
  const auto& eigenvalues = evidence.information_eigenvalues;
  if (!(eigenvalues[5] > 0)) return covariance;
  // Of 2-D scans the first three are of the motions in the plane, the others say nothing.
  const double typical = flat ? eigenvalues[1] : 0.5 * (eigenvalues[2] + eigenvalues[3]);
  const double most = square(noise.max_translation / noise.translation);
  // Only one direction is known: where a second one is weak as well, all directions count less.
  covariance *= inflation(eigenvalues[1], typical, most);
  Vector6d direction;
  for (int k = 0; k < 6; ++k)
    direction[k] = evidence.weakest_direction[static_cast<std::size_t>(k)];
  direction.tail<3>() *= unit;
  // The eigenvector is of unit length in radians and units; the noise refers to metres of it.
  const double extra =
      square(noise.translation / unit) * (inflation(eigenvalues[0], typical, most) - 1);
  return covariance + extra * direction * direction.transpose();
}

}  // namespace

pose_graph::UnalignedMatrix6d edge_information(const RegistrationMode& mode,
                                               const Eigen::Vector3d& source_centre,
                                               const EdgeNoiseOptions& noise, double unit,
                                               bool flat) {
  const Matrix6d covariance = covariance_at_centre(mode.evidence, noise, unit, flat);
  // An error d about the centre c of the target is the residual e = Ad(T^-1 Trans(c)) d.
  const pose_graph::Pose target_from_source{mode.target_from_source.linear(),
                                            mode.target_from_source.translation()};
  const Eigen::Vector3d centre = mode.target_from_source * source_centre;
  const Matrix6d d_by_e = pose_graph::adjoint(
      pose_graph::Pose{Eigen::Matrix3d::Identity(), -centre} * target_from_source);
  const Matrix6d information = d_by_e.transpose() * covariance.llt().solve(d_by_e);
  return 0.5 * (information + information.transpose());
}

Eigen::Vector3d overlap_centre(const RegistrationResult& result) {
  const CorrespondenceMoments& moments = result.source_moments;
  if (moments.count == 0) return Eigen::Vector3d::Zero();
  return moments.sum / static_cast<double>(moments.count);
}

}  // namespace gpureg::reconstruction
