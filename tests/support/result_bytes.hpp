// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/result.hpp"

namespace gpureg::test {

/// Everything but the timings, as bytes.
inline std::vector<char> bytes(const RegistrationResult& r) {
  std::vector<char> out;
  const auto add = [&](const void* data, std::size_t size) {
    out.insert(out.end(), static_cast<const char*>(data), static_cast<const char*>(data) + size);
  };
  add(r.target_from_source.matrix().data(), 16 * sizeof(double));
  add(&r.status, sizeof r.status);
  add(&r.reason, sizeof r.reason);
  add(&r.score, sizeof r.score);
  add(&r.inlier_rmse, sizeof r.inlier_rmse);
  const RegistrationStatistics& s = r.statistics;
  for (const std::uint64_t v :
       {std::uint64_t(s.source_points), std::uint64_t(s.target_points),
        std::uint64_t(s.correspondences), s.hypotheses, s.survivors, s.scored,
        std::uint64_t(s.points_scored), std::uint64_t(s.consensus), std::uint64_t(s.inliers),
        std::uint64_t(s.refine_iterations)})
    add(&v, sizeof v);
  const auto redwood = r.source_moments.information_redwood(),
             open3d = r.target_moments.information_open3d();
  add(redwood.data(), 36 * sizeof(double));
  add(open3d.data(), 36 * sizeof(double));
  for (const RegistrationMode& mode : r.modes) {
    add(mode.target_from_source.matrix().data(), 16 * sizeof(double));
    add(&mode.confidence, sizeof mode.confidence);
    add(&mode.equivalent, sizeof mode.equivalent);
    const PoseEvidence& e = mode.evidence;
    add(&e.match_inliers, sizeof e.match_inliers);
    for (const double v :
         {e.match_support, e.source_overlap, e.target_overlap, e.source_normal_weighted_overlap,
          e.target_normal_weighted_overlap, e.source_observed, e.target_observed,
          e.source_free_space_violation, e.target_free_space_violation, e.source_occluded,
          e.target_occluded, e.source_near_surface, e.target_near_surface,
          e.source_front_violation_near, e.target_front_violation_near,
          e.source_front_violation_far, e.target_front_violation_far, e.source_behind_surface,
          e.target_behind_surface})
      add(&v, sizeof v);
    add(e.information_eigenvalues.data(), e.information_eigenvalues.size() * sizeof(double));
  }
  return out;
}

}  // namespace gpureg::test
