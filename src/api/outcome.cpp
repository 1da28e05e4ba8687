// SPDX-License-Identifier: BSD-3-Clause
#include "api/outcome.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "api/confidence.hpp"
#include "api/evidence.hpp"
#include "api/frames.hpp"
#include "pipeline/conclude.hpp"

namespace gpureg {
namespace {

/// Moments of the local, scaled points to moments of the points in the cloud's frame.
CorrespondenceMoments to_frame(const Moments& m, const PreparedState& cloud) {
  const double unit = 1.0 / 1099511627776.0, r = cloud.radius;
  CorrespondenceMoments out;
  out.count = m.count;
  const double n = static_cast<double>(m.count);
  const Eigen::Vector3d o = origin_of(cloud);
  const Eigen::Vector3d s =
      Eigen::Vector3d(static_cast<double>(m.sum[0]), static_cast<double>(m.sum[1]),
                      static_cast<double>(m.sum[2])) *
      (unit * r);
  Eigen::Matrix3d q;
  const double f = unit * r * r;
  const auto e = [&](int k) { return static_cast<double>(m.outer[k]) * f; };
  q << e(0), e(1), e(2), e(1), e(3), e(4), e(2), e(4), e(5);
  out.sum = s + n * o;
  out.outer = q + s * o.transpose() + o * s.transpose() + n * o * o.transpose();
  return out;
}

/// The pose of the pair as the caller knows it: his source, his target, their frames.
UnalignedIsometry3d to_transform(const Pose<double>& pose, const PreparedState& source,
                                 const PreparedState& target, bool swapped) {
  const PreparedState& moved = swapped ? target : source;
  const PreparedState& fixed = swapped ? source : target;
  const Eigen::Quaterniond q(pose.w, pose.x, pose.y, pose.z);
  Eigen::Isometry3d fixed_from_moved = Eigen::Isometry3d::Identity();
  fixed_from_moved.linear() = q.normalized().toRotationMatrix();
  fixed_from_moved.translation() = Eigen::Vector3d(pose.tx, pose.ty, pose.tz) + origin_of(fixed) -
                                   fixed_from_moved.linear() * origin_of(moved);
  return swapped ? fixed_from_moved.inverse() : fixed_from_moved;
}

double rmse(std::uint64_t residual, std::uint32_t inliers, double distance) {
  return inliers > 0 ? distance * std::sqrt(static_cast<double>(residual) /
                                            static_cast<double>(kResidualScale) / inliers)
                     : 0.0;
}

RegistrationReason evidence_reason(const RegistrationStatistics& s, double confidence,
                                   bool contradicted, const RegistrationOptions& options) {
  if (s.source_points < 4) return RegistrationReason::too_few_source_points;
  if (s.target_points < 4) return RegistrationReason::too_few_target_points;
  if (s.correspondences < 4) return RegistrationReason::no_usable_features;
  if (s.scored == 0) return RegistrationReason::degenerate_geometry;
  if (contradicted) return RegistrationReason::contradicts_prior;
  return confidence < options.min_confidence ? RegistrationReason::confidence_too_low
                                             : RegistrationReason::none;
}

/// Root mean square distance between where two poses take the points that take part in
/// correspondences.
double distance_between(const UnalignedIsometry3d& a, const UnalignedIsometry3d& b,
                        const CorrespondenceMoments& points) {
  if (points.count == 0) return std::numeric_limits<double>::infinity();
  const double n = static_cast<double>(points.count);
  const Eigen::Matrix3d m = a.linear() - b.linear();
  const Eigen::Vector3d t = a.translation() - b.translation();
  return std::sqrt(
      std::max(0.0, ((m * points.outer * m.transpose()).trace() + 2 * t.dot(m * points.sum)) / n +
                        t.squaredNorm()));
}

/// What was slid and stayed further away than so much of the distance of modes, a quarter of a
/// metre at the usual voxels, is another place, and both cannot be right. Nearer, only the likelier
/// one is kept.
constexpr double kApart = 5.0 / 6;

void add_modes(const PairOutcome& outcome, const PreparedState& source, const PreparedState& target,
               bool swapped, const RegistrationOptions& options, RegistrationResult& result) {
  const PreparedState& moved = swapped ? target : source;
  const PreparedState& fixed = swapped ? source : target;
  std::vector<RegistrationMode> modes;
  // Of each family the first mode, from which others were slid.
  std::map<std::uint32_t, std::size_t> origins;
  const auto touching = [&](std::uint32_t family) {
    const ModeOutcome& origin = outcome.modes[origins.at(family)];
    return to_frame(swapped ? origin.target_moments : origin.source_moments, source);
  };
  for (std::size_t k = 0; k < outcome.modes.size(); ++k) {
    const ModeOutcome& mode = outcome.modes[k];
    RegistrationMode out;
    out.target_from_source = to_transform(mode.pose, source, target, swapped);
    // What was slid and came back is where it was, but less well refined: nearer than points are
    // matched, evidence cannot tell.
    const auto [origin, is_first] = origins.emplace(mode.family, k);
    if (!is_first) {
      const UnalignedIsometry3d before =
          to_transform(outcome.modes[origin->second].pose, source, target, swapped);
      if (distance_between(out.target_from_source, before, touching(mode.family)) <=
          static_cast<double>(options.score.max_correspondence_distance))
        continue;
    }
    out.evidence = to_evidence(outcome, mode, moved, fixed, swapped);
    out.found_as = static_cast<std::uint32_t>(k);
    modes.push_back(out);
  }
  const ModeOutcome& first = outcome.modes.front();
  const Eigen::Vector3d middle = middle_of(
      to_frame(swapped ? first.target_moments : first.source_moments, source), origin_of(source));
  const auto points_touching = [&](const RegistrationMode& m) {
    const ModeOutcome& mode = outcome.modes[m.found_as];
    return Touching{std::min(mode.source.inliers, mode.target.inliers),
                    std::min(mode.source.tested, mode.target.tested)};
  };
  set_confidences(
      modes, options.evidence.modes, points_touching,
      [&](const RegistrationMode& a, const RegistrationMode& b) {
        const std::uint32_t family = outcome.modes[a.found_as].family;
        const CorrespondenceMoments points =
            family == outcome.modes[b.found_as].family ? touching(family) : CorrespondenceMoments{};
        if (points.count > 0)
          return distance_between(a.target_from_source, b.target_from_source, points) <=
                 kApart * static_cast<double>(options.evidence.mode_distance);
        return same_mode_at(a.target_from_source, b.target_from_source, middle, options.evidence);
      });
  result.modes = std::move(modes);
  const ModeOutcome& best = outcome.modes[result.modes.front().found_as];
  result.has_candidate = true;
  result.target_from_source = result.modes.front().target_from_source;
  result.score = result.modes.front().confidence;
  result.statistics.points_scored = best.source.tested;
  result.statistics.inliers = result.statistics.consensus = best.source.inliers;
  result.statistics.refine_iterations = best.iterations;
  result.inlier_ratio = pipeline::inlier_ratio(result.statistics);
  result.inlier_rmse = rmse(best.source.residual, best.source.inliers,
                            static_cast<double>(options.score.max_correspondence_distance));
  result.source_moments = to_frame(swapped ? best.target_moments : best.source_moments, source);
  result.target_moments = to_frame(swapped ? best.source_moments : best.target_moments, target);
}

}  // namespace

RegistrationResult to_result(const PairOutcome& all, const PreparedState& source,
                             const PreparedState& target, bool swapped,
                             const RegistrationOptions& options, const PriorTest& prior) {
  // Refinement moves poses, so they are asked again.
  const bool some_contradict =
      std::any_of(all.modes.begin(), all.modes.end(),
                  [&](const ModeOutcome& m) { return !permitted(prior, to_rigid(m.pose)); });
  PairOutcome kept;
  if (some_contradict) {
    kept = all;
    kept.modes.erase(
        std::remove_if(kept.modes.begin(), kept.modes.end(),
                       [&](const ModeOutcome& m) { return !permitted(prior, to_rigid(m.pose)); }),
        kept.modes.end());
  }
  const PairOutcome& outcome = some_contradict ? kept : all;
  RegistrationResult result;
  result.reason = outcome.reason;
  result.status = outcome.reason == RegistrationReason::none ? RegistrationStatus::aligned
                                                             : RegistrationStatus::not_aligned;
  result.has_candidate = outcome.has_pose;
  result.statistics = outcome.statistics;
  result.timings = outcome.timings;
  result.statistics.swapped = swapped;
  if (swapped) {
    std::swap(result.statistics.source_points, result.statistics.target_points);
    if (result.reason == RegistrationReason::too_few_source_points)
      result.reason = RegistrationReason::too_few_target_points;
    else if (result.reason == RegistrationReason::too_few_target_points)
      result.reason = RegistrationReason::too_few_source_points;
  }
  if (options.hypothesis.proposal == Proposal::compatibility) {
    if (!outcome.modes.empty()) add_modes(outcome, source, target, swapped, options, result);
    const RegistrationStatistics& s = result.statistics;
    result.reason =
        evidence_reason(s, result.score, some_contradict && outcome.modes.empty(), options);
    result.status = result.reason == RegistrationReason::none ? RegistrationStatus::aligned
                                                              : RegistrationStatus::not_aligned;
    return result;
  }
  if (!outcome.has_pose) return result;

  result.target_from_source = to_transform(outcome.pose, source, target, swapped);
  result.inlier_ratio = pipeline::inlier_ratio(outcome.statistics);
  result.score = result.inlier_ratio;
  result.inlier_rmse = rmse(outcome.support.residual, outcome.support.inliers,
                            static_cast<double>(options.score.max_correspondence_distance));
  result.source_moments =
      to_frame(swapped ? outcome.target_moments : outcome.source_moments, source);
  result.target_moments =
      to_frame(swapped ? outcome.source_moments : outcome.target_moments, target);
  return result;
}

}  // namespace gpureg
