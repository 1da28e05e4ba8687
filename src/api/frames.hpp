// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

#include "algorithm/evidence.hpp"
#include "gpureg/options.hpp"
#include "gpureg/result.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

/// Local origin of a cloud in its frame; prepared points are relative to it.
inline Eigen::Vector3d origin_of(const PreparedState& cloud) {
  return Eigen::Vector3f(cloud.origin[0], cloud.origin[1], cloud.origin[2]).cast<double>();
}

/// Centre of the source points in correspondences, or `otherwise` where there are none.
inline Eigen::Vector3d middle_of(const CorrespondenceMoments& m, const Eigen::Vector3d& otherwise) {
  return m.count > 0 ? Eigen::Vector3d(m.sum / static_cast<double>(m.count)) : otherwise;
}

/// Comparison of two modes at the centre of the cloud. The stages compare modes at the local origin
/// (same_mode()), which a stray point may place far from the cloud. middle: in the frame of the
/// source.
inline bool same_mode_at(const UnalignedIsometry3d& a, const UnalignedIsometry3d& b,
                         const Eigen::Vector3d& middle, const EvidenceOptions& options) {
  return (a.linear().transpose() * b.linear()).trace() >=
             static_cast<double>(mode_trace(options.mode_angle)) &&
         (a * middle - b * middle).norm() <= static_cast<double>(options.mode_distance);
}

}  // namespace gpureg
