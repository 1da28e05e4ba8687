// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "api/frames.hpp"
#include "confidence/confidence.hpp"
#include "confidence/pose_evidence.hpp"
#include "flat/planar_pose.hpp"
#include "sensor_fixed/common_view.hpp"

namespace gpureg {

/// What the engine measured of the poses of a pair, in the caller's order of the clouds. Poses and
/// moments are between the rows of the clouds, as large origins would cost their differences the
/// last digits.
struct AlignedPair {
  const PreparedState& source;
  const PreparedState& target;
  bool swapped;  ///< the engine moved the target
  const RegistrationSettings& options;

  bool flat() const { return planar_pair(source, target); }

  UnalignedIsometry3d transform_of(const Pose<double>& pose) const {
    const UnalignedIsometry3d found = to_transform(pose, source, target, swapped);
    return flat() ? planar(found, source.plane, target.plane, origin_of(source)) : found;
  }
  bool contradicts_common_view(const ModeOutcome& mode) const {
    return gpureg::contradicts_common_view(
        mode, swapped ? target : source, swapped ? source : target,
        static_cast<double>(options.prepare.max_correspondence_distance));
  }
  /// Of all modes, in their order.
  std::vector<PoseEvidence> evidence_of(const PairOutcome& outcome) const {
    const PreparedState &moved = swapped ? target : source, &fixed = swapped ? source : target;
    std::vector<const ModeOutcome*> modes;
    for (const ModeOutcome& mode : outcome.modes) modes.push_back(&mode);
    const auto spectra = confidence::spectra_of(modes, moved, fixed);
    std::vector<PoseEvidence> out;
    for (std::size_t k = 0; k < modes.size(); ++k)
      out.push_back(confidence::evidence_of(outcome, *modes[k], spectra[k], moved, fixed, swapped));
    return out;
  }
  /// Points in correspondences. Measured: ModeOutcome or PairOutcome.
  template <typename Measured>
  CorrespondenceMoments source_moments(const Measured& pose) const {
    return of_scan(to_frame(swapped ? pose.target_moments : pose.source_moments, source), source);
  }
  template <typename Measured>
  CorrespondenceMoments target_moments(const Measured& pose) const {
    return of_scan(to_frame(swapped ? pose.source_moments : pose.target_moments, target), target);
  }
  CorrespondenceMoments of_scan(const CorrespondenceMoments& moments,
                                const PreparedState& cloud) const {
    return flat() ? planar(moments, cloud.plane) : moments;
  }
  double rmse(std::uint64_t residual, std::uint32_t inliers) const {
    const double distance = static_cast<double>(options.prepare.max_correspondence_distance);
    return inliers > 0 ? distance * std::sqrt(static_cast<double>(residual) /
                                              static_cast<double>(kResidualScale) / inliers)
                       : 0.0;
  }
  double rmse(const SideEvidence& side) const {
    return rmse(static_cast<std::uint64_t>(side[Term::residual]), side.points(Term::inliers));
  }
  static confidence::OverlapCount overlap_of(const ModeOutcome& mode) {
    const auto least = [&](Term term) {
      return std::min(mode.source.points(term), mode.target.points(term));
    };
    return {least(Term::inliers), least(Term::tested)};
  }
  confidence::Ranking ranking_of(const std::vector<PoseEvidence>& poses) const {
    return confidence::ranking_of(poses, source, target);
  }
};

}  // namespace gpureg
