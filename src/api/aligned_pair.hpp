// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "api/access.hpp"
#include "api/frames.hpp"
#include "api/prior.hpp"
#include "confidence/confidence.hpp"
#include "confidence/pose_evidence.hpp"
#include "flat/planar_pose.hpp"
#include "gpureg/registration.hpp"
#include "sensor_fixed/common_view.hpp"

namespace gpureg {

/// Two clouds in the caller's order, for the engine and from what it measured. Poses and moments
/// are between the rows of the clouds, as large origins would cost their differences the last
/// digits. Clouds and options must outlive it.
struct AlignedPair {
  const PreparedState& source;
  const PreparedState& target;
  const RegistrationSettings& options;
  bool swapped;  ///< the engine moves the target, being the smaller cloud

  AlignedPair(const PreparedState& from, const PreparedState& to,
              const RegistrationSettings& settings)
      : source(from),
        target(to),
        options(settings),
        swapped(settings.smaller_as_source && to.size < from.size) {}

  const PreparedState& moved() const { return swapped ? target : source; }
  const PreparedState& fixed() const { return swapped ? source : target; }
  bool flat() const { return planar_pair(source, target); }
  bool with_model() const {
    return confidence::with_model(source.statistics.viewpoint, target.statistics.viewpoint);
  }

  /// For the engine: with the prior, and with the planes of two 2-D scans.
  PairInput input(const RegistrationPrior& prior = {}) const {
    return {&moved(), &fixed(), {}, {}, prior_test(prior, source, target, swapped)};
  }
  /// @param target_from_source between the clouds' frames.
  Pose<double> local_of(const UnalignedIsometry3d& target_from_source) const {
    const Eigen::Isometry3d of_rows = rows_from_frames(target_from_source, source, target);
    return local_from_rows(swapped ? of_rows.inverse() : of_rows, moved(), fixed());
  }
  UnalignedIsometry3d transform_of(const Pose<double>& pose) const {
    const Eigen::Isometry3d fixed_from_moved = rows_from_local(pose, moved(), fixed());
    const UnalignedIsometry3d found = swapped ? fixed_from_moved.inverse() : fixed_from_moved;
    return flat() ? planar(found, source.plane, target.plane, origin_of(source)) : found;
  }
  bool contradicts_common_view(const ModeOutcome& mode) const {
    return gpureg::contradicts_common_view(
        mode, moved(), fixed(), static_cast<double>(options.prepare.max_correspondence_distance));
  }
  /// Of all modes, in their order.
  std::vector<PoseEvidence> evidence_of(const PairOutcome& outcome) const {
    std::vector<const ModeOutcome*> modes;
    for (const ModeOutcome& mode : outcome.modes) modes.push_back(&mode);
    const auto spectra = confidence::spectra_of(modes, moved(), fixed());
    std::vector<PoseEvidence> out;
    for (std::size_t k = 0; k < modes.size(); ++k)
      out.push_back(
          confidence::evidence_of(outcome, *modes[k], spectra[k], moved(), fixed(), swapped));
    return out;
  }
  /// Points in correspondences. Measured: ModeOutcome or PairOutcome.
  template <typename Measured>
  CorrespondenceMoments source_moments(const Measured& pose) const {
    return of_scan(swapped ? pose.target_moments : pose.source_moments, source);
  }
  template <typename Measured>
  CorrespondenceMoments target_moments(const Measured& pose) const {
    return of_scan(swapped ? pose.source_moments : pose.target_moments, target);
  }
  CorrespondenceMoments of_scan(const Moments& local, const PreparedState& cloud) const {
    const CorrespondenceMoments moments = to_frame(local, cloud);
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

/// One way to take the sides of both clouds of a pair.
struct PairVariant {
  std::size_t pair;  ///< index into the pairs
  AlignedPair clouds;
};

/// Each pair with each of the sides of its clouds. The variants of a pair are neighbours.
inline std::vector<PairVariant> variants_of(const std::vector<PreparedCloud>& clouds,
                                            const std::vector<Pair>& pairs,
                                            const RegistrationSettings& options) {
  std::vector<PairVariant> out;
  for (std::size_t p = 0; p < pairs.size(); ++p)
    for (const PreparedState* s : Access::state(clouds[pairs[p].source])->with_sides())
      for (const PreparedState* t : Access::state(clouds[pairs[p].target])->with_sides())
        out.push_back({p, {*s, *t, options}});
  return out;
}

}  // namespace gpureg
