// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "gpureg/result.hpp"
#include "pipeline/scan_plane.hpp"

namespace gpureg {

inline Eigen::Vector3d normal_of(const ScanPlane& plane) {
  return Eigen::Vector3d(plane.normal[0], plane.normal[1], plane.normal[2]);
}

/// The closest pose, at a point of the source, that moves the plane of the source onto that of the
/// target, exactly: a rotation about the normal, a translation in the plane. Elements of axes that
/// the planes do not mix are exactly 0 or 1.
UnalignedIsometry3d planar(const UnalignedIsometry3d& target_from_source, const ScanPlane& source,
                           const ScanPlane& target, const Eigen::Vector3d& source_point);

/// Moments of the layers of a scan as those of the scan: in its plane, counted once.
CorrespondenceMoments planar(const CorrespondenceMoments& moments, const ScanPlane& plane);

}  // namespace gpureg
