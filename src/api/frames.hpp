// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>

#include "algorithm/evidence.hpp"
#include "gpureg/result.hpp"
#include "pipeline/engine.hpp"
#include "settings/settings.hpp"

namespace gpureg {

/// Local origin of a prepared cloud, relative to the caller's rows.
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
                         const Eigen::Vector3d& middle, const EvidenceSettings& options) {
  return (a.linear().transpose() * b.linear()).trace() >=
             static_cast<double>(mode_trace(options.mode_angle)) &&
         (a * middle - b * middle).norm() <= static_cast<double>(options.mode_distance);
}

inline Eigen::Vector3d offset_of(const PreparedState& cloud) {
  return Eigen::Map<const Eigen::Vector3d>(cloud.frame_offset);
}

/// Moments of the local, scaled points to moments of the caller's rows.
CorrespondenceMoments to_frame(const Moments& moments, const PreparedState& cloud);

/// A local pose of the moved in the fixed cloud as one between the caller's rows, and back.
Eigen::Isometry3d rows_from_local(const Pose<double>& pose, const PreparedState& moved,
                                  const PreparedState& fixed);
Pose<double> local_from_rows(const Eigen::Isometry3d& fixed_from_moved, const PreparedState& moved,
                             const PreparedState& fixed);

/// A pose between the clouds' frames as one between their rows.
Eigen::Isometry3d rows_from_frames(const UnalignedIsometry3d& target_from_source,
                                   const PreparedState& source, const PreparedState& target);

/// A pose and moments between the rows of two clouds into the clouds' frames.
void move_to_frame(UnalignedIsometry3d& target_from_source, const PreparedState& source,
                   const PreparedState& target);
void move_to_frame(CorrespondenceMoments& moments, const PreparedState& cloud);

/// A result between the rows of two clouds into the clouds' frames, see PointCloudView::origin.
/// Last of all: with large offsets, differences of poses would lose their digits.
void move_to_frames(RegistrationResult& result, const PreparedState& source,
                    const PreparedState& target);

/// Minimum RMS displacement, as a fraction of mode_distance, for a perturbed pose to count as a
/// mode of its own: a quarter of a metre at the default voxel size. Nearer, only the more likely
/// one of the two is kept.
constexpr double kDistinctModeFraction = 5.0 / 6;

/// RMS distance between the positions to which two poses move the points of correspondences;
/// infinite without points. points: relative to the frame that the poses move.
double distance_between(const UnalignedIsometry3d& a, const UnalignedIsometry3d& b,
                        const CorrespondenceMoments& points);

}  // namespace gpureg
