// SPDX-License-Identifier: BSD-3-Clause
#include "api/outcome.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "api/frames.hpp"
#include "confidence/calibrate_modes.hpp"
#include "confidence/confidence.hpp"
#include "confidence/pose_evidence.hpp"
#include "pipeline/conclude.hpp"
#include "symmetry/symmetry.hpp"

namespace gpureg {
namespace {

/// Largest difference of the log odds of poses that the clouds cannot tell apart: a factor of ten.
constexpr double kSimilarLogOdds = 2.302585;
/// Poses whose confidences add up to less are hopeless, symmetric or not.
constexpr double kWorthTesting = 0.05;
/// Prepared points of the largest cloud whose symmetry is tested; parts have some thousand.
constexpr std::uint32_t kLargestSymmetric = 200'000;

double rmse(std::uint64_t residual, std::uint32_t inliers, double distance) {
  return inliers > 0 ? distance * std::sqrt(static_cast<double>(residual) /
                                            static_cast<double>(kResidualScale) / inliers)
                     : 0.0;
}

RegistrationReason evidence_reason(const RegistrationResult& result, bool contradicted,
                                   const RegistrationOptions& options) {
  const RegistrationStatistics& s = result.statistics;
  if (s.source_points < limits::kMinMatches) return RegistrationReason::too_few_source_points;
  if (s.target_points < limits::kMinMatches) return RegistrationReason::too_few_target_points;
  if (s.correspondences < limits::kMinMatches) return RegistrationReason::no_usable_features;
  if (s.scored == 0) return RegistrationReason::degenerate_geometry;
  if (contradicted) return RegistrationReason::contradicts_prior;
  if (result.score >= options.min_confidence) return RegistrationReason::none;
  if (result.symmetry_confidence() < options.min_confidence)
    return RegistrationReason::confidence_too_low;
  return options.accept_symmetry ? RegistrationReason::none : RegistrationReason::symmetric;
}

RegistrationStatus status_of(const RegistrationResult& result, const RegistrationOptions& options) {
  if (result.reason != RegistrationReason::none) return RegistrationStatus::not_aligned;
  return result.score >= options.min_confidence ? RegistrationStatus::aligned
                                                : RegistrationStatus::aligned_up_to_symmetry;
}

/// The modes of one pair, in the frames of its clouds.
class Modes {
 public:
  Modes(const PairOutcome& outcome, const PreparedState& source, const PreparedState& target,
        bool swapped, const RegistrationOptions& options)
      : outcome_(outcome), source_(source), target_(target), swapped_(swapped), options_(options) {
    for (std::size_t k = 0; k < outcome.modes.size(); ++k) add(k);
    const ModeOutcome& first = outcome.modes.front();
    middle_ = middle_of(source_moments(first), origin_of(source));
  }

  /// Ranks the modes by their evidence, drops each that equals a better one, and fills in the
  /// confidences.
  std::vector<RegistrationMode> ranked() const {
    std::vector<PoseEvidence> evidence;
    for (const RegistrationMode& mode : modes_) evidence.push_back(mode.evidence);
    const confidence::AvailableEvidence available = confidence::available_evidence(
        evidence, source_.statistics.viewpoint, target_.statistics.viewpoint);
    const std::vector<double> log_odds = confidence::rank_modes(evidence, available);
    std::vector<std::size_t> order(modes_.size());
    std::iota(order.begin(), order.end(), std::size_t(0));
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return log_odds[a] > log_odds[b]; });
    std::vector<RegistrationMode> out;
    std::vector<confidence::RankedMode> distinct;
    for (const std::size_t k : order) {
      const RegistrationMode& mode = modes_[k];
      if (std::any_of(out.begin(), out.end(),
                      [&](const RegistrationMode& better) { return same(better, mode); }))
        continue;
      out.push_back(mode);
      distinct.push_back({mode.evidence, log_odds[k], overlap_of(mode)});
    }
    auto confidences = confidence::confidences_of(distinct, available, options_.evidence.modes);
    set_confidences(confidences, out);
    mark_equivalents(distinct, out);
    std::vector<bool> equivalent;
    for (const RegistrationMode& mode : out) equivalent.push_back(mode.equivalent);
    confidence::calibrate_modes(options_.calibration, equivalent, confidences);
    set_confidences(confidences, out);
    return out;
  }

 private:
  static void set_confidences(const std::vector<confidence::ModeConfidence>& from,
                              std::vector<RegistrationMode>& modes) {
    for (std::size_t k = 0; k < modes.size(); ++k) {
      modes[k].confidence = from[k].confidence;
      modes[k].overlap_confidence = from[k].overlap_confidence;
    }
  }

  /// Marks the modes that a symmetry of the larger cloud carries into the first one.
  void mark_equivalents(const std::vector<confidence::RankedMode>& ranked,
                        std::vector<RegistrationMode>& modes) const {
    const auto close = [&](std::size_t k) {
      return ranked[k].log_odds >= ranked.front().log_odds - kSimilarLogOdds;
    };
    const PreparedState& larger = source_.size > target_.size ? source_ : target_;
    std::size_t last = 1;
    while (last < modes.size() && close(last)) ++last;
    double together = 0;
    for (std::size_t k = 0; k < last; ++k) together += modes[k].confidence;
    if (last == 1 || together < kWorthTesting || larger.size > kLargestSymmetric) return;
    CloudSymmetry symmetry(larger.copy_points(), larger.copy_normals(),
                           options_.prepare.max_correspondence_distance);
    const double slack =
        kDistinctModeFraction * static_cast<double>(options_.evidence.mode_distance);
    const Eigen::Vector3d origin = origin_of(larger);
    for (std::size_t k = 1; k < last; ++k) {
      const Eigen::Isometry3d first(modes.front().target_from_source.matrix());
      const Eigen::Isometry3d other(modes[k].target_from_source.matrix());
      Eigen::Isometry3d motion =
          &larger == &source_ ? first.inverse() * other : other * first.inverse();
      motion.translation() += motion.linear() * origin - origin;
      modes[k].equivalent = symmetry.has(motion, slack);
    }
  }

  CorrespondenceMoments source_moments(const ModeOutcome& mode) const {
    return to_frame(swapped_ ? mode.target_moments : mode.source_moments, source_);
  }
  /// Moments of the source points in correspondences under the origin mode.
  CorrespondenceMoments origin_moments(std::uint32_t origin_mode) const {
    return source_moments(outcome_.modes[origins_.at(origin_mode)]);
  }

  void add(std::size_t k) {
    const ModeOutcome& mode = outcome_.modes[k];
    RegistrationMode out;
    out.target_from_source = to_transform(mode.pose, source_, target_, swapped_);
    // A perturbed pose within the correspondence distance of its origin is that mode, less well
    // refined; evidence cannot separate poses that close.
    const auto [origin, is_first] = origins_.emplace(mode.origin_mode, k);
    if (!is_first) {
      const UnalignedIsometry3d before =
          to_transform(outcome_.modes[origin->second].pose, source_, target_, swapped_);
      if (distance_between(out.target_from_source, before, origin_moments(mode.origin_mode)) <=
          static_cast<double>(options_.prepare.max_correspondence_distance))
        return;
    }
    out.evidence = confidence::evidence_of(outcome_, mode, swapped_ ? target_ : source_,
                                           swapped_ ? source_ : target_, swapped_);
    out.rank_before_refinement = static_cast<std::uint32_t>(k);
    modes_.push_back(out);
  }

  const ModeOutcome& outcome_of(const RegistrationMode& mode) const {
    return outcome_.modes[mode.rank_before_refinement];
  }

  confidence::OverlapCount overlap_of(const RegistrationMode& m) const {
    const ModeOutcome& mode = outcome_of(m);
    return {std::min(mode.source.inliers, mode.target.inliers),
            std::min(mode.source.tested, mode.target.tested)};
  }

  bool same(const RegistrationMode& a, const RegistrationMode& b) const {
    const std::uint32_t origin = outcome_of(a).origin_mode;
    const CorrespondenceMoments points =
        origin == outcome_of(b).origin_mode ? origin_moments(origin) : CorrespondenceMoments{};
    if (points.count > 0)
      return distance_between(a.target_from_source, b.target_from_source, points) <=
             kDistinctModeFraction * static_cast<double>(options_.evidence.mode_distance);
    return same_mode_at(a.target_from_source, b.target_from_source, middle_, options_.evidence);
  }

  const PairOutcome& outcome_;
  const PreparedState& source_;
  const PreparedState& target_;
  bool swapped_;
  const RegistrationOptions& options_;
  std::map<std::uint32_t, std::size_t> origins_;  ///< first mode of each origin mode
  std::vector<RegistrationMode> modes_;
  Eigen::Vector3d middle_;  ///< centre of the source points in correspondences
};

void add_modes(const PairOutcome& outcome, const PreparedState& source, const PreparedState& target,
               bool swapped, const RegistrationOptions& options, RegistrationResult& result) {
  result.modes = Modes(outcome, source, target, swapped, options).ranked();
  const ModeOutcome& best = outcome.modes[result.modes.front().rank_before_refinement];
  result.has_candidate = true;
  result.target_from_source = result.modes.front().target_from_source;
  result.score = result.modes.front().confidence;
  result.statistics.points_scored = best.source.tested;
  result.statistics.inliers = result.statistics.consensus = best.source.inliers;
  result.statistics.refine_iterations = best.iterations;
  result.inlier_ratio = pipeline::inlier_ratio(result.statistics);
  result.inlier_rmse = rmse(best.source.residual, best.source.inliers,
                            static_cast<double>(options.prepare.max_correspondence_distance));
  result.source_moments = to_frame(swapped ? best.target_moments : best.source_moments, source);
  result.target_moments = to_frame(swapped ? best.source_moments : best.target_moments, target);
}

}  // namespace

RegistrationResult to_row_result(const PairOutcome& all, const PreparedState& source,
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
  result.source_viewpoint = source.statistics.viewpoint;
  result.target_viewpoint = target.statistics.viewpoint;
  result.statistics.swapped = swapped;
  if (swapped) {
    std::swap(result.statistics.source_points, result.statistics.target_points);
    if (result.reason == RegistrationReason::too_few_source_points)
      result.reason = RegistrationReason::too_few_target_points;
    else if (result.reason == RegistrationReason::too_few_target_points)
      result.reason = RegistrationReason::too_few_source_points;
  }
  if (options.method == RegistrationMethod::compatibility) {
    if (!outcome.modes.empty()) add_modes(outcome, source, target, swapped, options, result);
    result.reason = evidence_reason(result, some_contradict && outcome.modes.empty(), options);
    result.status = status_of(result, options);
    return result;
  }
  if (!outcome.has_pose) return result;

  result.target_from_source = to_transform(outcome.pose, source, target, swapped);
  result.inlier_ratio = pipeline::inlier_ratio(outcome.statistics);
  result.score = result.inlier_ratio;
  result.inlier_rmse = rmse(outcome.support.residual, outcome.support.inliers,
                            static_cast<double>(options.prepare.max_correspondence_distance));
  result.source_moments =
      to_frame(swapped ? outcome.target_moments : outcome.source_moments, source);
  result.target_moments =
      to_frame(swapped ? outcome.source_moments : outcome.target_moments, target);
  return result;
}

RegistrationResult to_result(const PairOutcome& outcome, const PreparedState& source,
                             const PreparedState& target, bool swapped,
                             const RegistrationOptions& options, const PriorTest& prior) {
  RegistrationResult result = to_row_result(outcome, source, target, swapped, options, prior);
  move_to_frames(result, source, target);
  return result;
}

}  // namespace gpureg
