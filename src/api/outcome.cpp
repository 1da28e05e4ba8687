// SPDX-License-Identifier: BSD-3-Clause
#include "api/outcome.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "confidence/calibrate_modes.hpp"
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

RegistrationReason evidence_reason(const RegistrationResult& result, bool contradicted,
                                   const RegistrationSettings& options) {
  const RegistrationStatistics& s = result.statistics;
  if (s.source_points < limits::kMinMatches) return RegistrationReason::too_few_source_points;
  if (s.target_points < limits::kMinMatches) return RegistrationReason::too_few_target_points;
  if (s.correspondences < limits::kMinMatches) return RegistrationReason::no_usable_features;
  if (s.scored == 0)
    return diagnose(result) == RegistrationReason::too_few_points
               ? RegistrationReason::too_few_points
               : RegistrationReason::degenerate_geometry;
  if (contradicted) return RegistrationReason::contradicts_prior;
  if (result.confidence >= options.min_confidence) return RegistrationReason::none;
  if (result.symmetry_confidence() < options.min_confidence) return diagnose(result);
  return options.accept_symmetry ? RegistrationReason::none : RegistrationReason::symmetric;
}

RegistrationStatus status_of(const RegistrationResult& result,
                             const RegistrationSettings& options) {
  if (result.reason != RegistrationReason::none) return RegistrationStatus::not_aligned;
  return result.confidence >= options.min_confidence ? RegistrationStatus::aligned
                                                     : RegistrationStatus::aligned_up_to_symmetry;
}

/// A pose under which nothing overlaps is no candidate. Its confidence is 0.
void drop_candidate(RegistrationResult& result) {
  result.target_from_source = no_pose();
  result.modes.clear();
}

/// The modes of one pair, in the frames of its clouds.
class Modes {
 public:
  Modes(const PairOutcome& outcome, const AlignedPair& pair)
      : outcome_(outcome), pair_(pair), options_(pair.options) {
    const std::vector<PoseEvidence> evidence = pair.evidence_of(outcome);
    for (std::size_t k = 0; k < outcome.modes.size(); ++k) add(k, evidence[k]);
    const ModeOutcome& first = outcome.modes.front();
    middle_ = middle_of(pair.source_moments(first), origin_of(pair.source));
  }

  /// Ranks the modes by their evidence, drops each that equals a better one, and fills in the
  /// confidences.
  std::vector<RegistrationMode> ranked() const {
    std::vector<PoseEvidence> evidence;
    for (const RegistrationMode& mode : modes_) evidence.push_back(mode.evidence);
    const confidence::Ranking ranking = pair_.ranking_of(evidence);
    std::vector<RegistrationMode> out;
    std::vector<confidence::RankedMode> distinct;
    for (const std::size_t k : ranking.order) {
      const RegistrationMode& mode = modes_[k];
      if (std::any_of(out.begin(), out.end(),
                      [&](const RegistrationMode& better) { return same(better, mode); }))
        continue;
      out.push_back(mode);
      distinct.push_back({mode.evidence, ranking.log_odds[k], pair_.overlap_of(outcome_of(mode))});
    }
    auto confidences =
        confidence::confidences_of(distinct, ranking.available, options_.evidence.modes);
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
    const PreparedState& larger =
        pair_.source.size > pair_.target.size ? pair_.source : pair_.target;
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
          &larger == &pair_.source ? first.inverse() * other : other * first.inverse();
      motion.translation() += motion.linear() * origin - origin;
      modes[k].equivalent = symmetry.has(motion, slack);
    }
  }

  /// Moments of the source points in correspondences under the origin mode.
  CorrespondenceMoments origin_moments(std::uint32_t origin_mode) const {
    return pair_.source_moments(outcome_.modes[origins_.at(origin_mode)]);
  }

  void add(std::size_t k, const PoseEvidence& evidence) {
    const ModeOutcome& mode = outcome_.modes[k];
    RegistrationMode out;
    out.target_from_source = pair_.transform_of(mode.pose);
    // A perturbed pose within the correspondence distance of its origin is that mode, less well
    // refined; evidence cannot separate poses that close.
    const auto [origin, is_first] = origins_.emplace(mode.origin_mode, k);
    if (!is_first) {
      const UnalignedIsometry3d before = pair_.transform_of(outcome_.modes[origin->second].pose);
      if (distance_between(out.target_from_source, before, origin_moments(mode.origin_mode)) <=
          static_cast<double>(options_.prepare.max_correspondence_distance))
        return;
    }
    out.evidence = evidence;
    out.rank_before_refinement = static_cast<std::uint32_t>(k);
    modes_.push_back(out);
  }

  const ModeOutcome& outcome_of(const RegistrationMode& mode) const {
    return outcome_.modes[mode.rank_before_refinement];
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
  const AlignedPair& pair_;
  const RegistrationSettings& options_;
  std::map<std::uint32_t, std::size_t> origins_;  ///< first mode of each origin mode
  std::vector<RegistrationMode> modes_;
  Eigen::Vector3d middle_;  ///< centre of the source points in correspondences
};

void add_modes(const PairOutcome& outcome, const AlignedPair& pair, RegistrationResult& result) {
  result.modes = Modes(outcome, pair).ranked();
  const ModeOutcome& best = outcome.modes[result.modes.front().rank_before_refinement];
  result.target_from_source = result.modes.front().target_from_source;
  result.confidence = result.modes.front().confidence;
  result.statistics.points_scored = best.source.points(Term::tested);
  result.statistics.inliers = result.statistics.consensus = best.source.points(Term::inliers);
  result.statistics.refine_iterations = best.iterations;
  result.inlier_ratio = pipeline::inlier_ratio(result.statistics);
  result.inlier_rmse = pair.rmse(best.source);
  result.source_moments = pair.source_moments(best);
  result.target_moments = pair.target_moments(best);
}

}  // namespace

RegistrationResult to_row_result(const PairOutcome& all, const AlignedPair& pair,
                                 const PriorTest& prior) {
  // Refinement moves poses, so they are asked again. Nothing speaks against a 2-D scan that it
  // moved to where nothing overlaps.
  bool contradicts_prior = false;
  const auto forbidden = [&](const ModeOutcome& m) {
    const bool refused =
        !permitted(prior, to_rigid(m.pose)) || (pair.flat() && confidence::without_overlap(m));
    contradicts_prior |= refused;
    return refused || pair.contradicts_common_view(m);
  };
  const bool some_contradict = std::any_of(all.modes.begin(), all.modes.end(), forbidden);
  PairOutcome kept;
  if (some_contradict) {
    kept = all;
    kept.modes.erase(std::remove_if(kept.modes.begin(), kept.modes.end(), forbidden),
                     kept.modes.end());
  }
  const PairOutcome& outcome = some_contradict ? kept : all;
  RegistrationResult result;
  result.reason = outcome.reason;
  result.status = outcome.reason == RegistrationReason::none ? RegistrationStatus::aligned
                                                             : RegistrationStatus::not_aligned;
  result.statistics = outcome.statistics;
  result.timings = outcome.timings;
  result.source_viewpoint = pair.source.statistics.viewpoint;
  result.target_viewpoint = pair.target.statistics.viewpoint;
  result.statistics.swapped = pair.swapped;
  result.flat = pair.flat();
  result.voxel_size = pair.target.options.unit;
  if (pair.swapped) {
    std::swap(result.statistics.source_points, result.statistics.target_points);
    if (result.reason == RegistrationReason::too_few_source_points)
      result.reason = RegistrationReason::too_few_target_points;
    else if (result.reason == RegistrationReason::too_few_target_points)
      result.reason = RegistrationReason::too_few_source_points;
  }
  if (pair.options.method == RegistrationMethod::compatibility) {
    if (pair.source.plane.exists() != pair.target.plane.exists() && pair.source.size > 0 &&
        pair.target.size > 0) {
      result.reason = RegistrationReason::flat_with_solid;
      result.status = RegistrationStatus::not_aligned;
      return result;
    }
    if (!outcome.modes.empty()) add_modes(outcome, pair, result);
    result.reason =
        pair.flat() && outcome.modes.empty() && outcome.statistics.scored > 0
            ? RegistrationReason::confidence_too_low
            : evidence_reason(result, outcome.modes.empty() && contradicts_prior, pair.options);
    result.status = status_of(result, pair.options);
    if (result.reason != RegistrationReason::none && result.statistics.inliers == 0)
      drop_candidate(result);
    return result;
  }
  if (!outcome.has_pose) return result;

  result.target_from_source = pair.transform_of(outcome.pose);
  result.inlier_ratio = pipeline::inlier_ratio(outcome.statistics);
  result.confidence = result.inlier_ratio;
  result.inlier_rmse = pair.rmse(outcome.support.residual, outcome.support.inliers);
  result.source_moments = pair.source_moments(outcome);
  result.target_moments = pair.target_moments(outcome);
  return result;
}

RegistrationResult to_result(const PairOutcome& outcome, const AlignedPair& pair,
                             const PriorTest& prior) {
  RegistrationResult result = to_row_result(outcome, pair, prior);
  move_to_frames(result, pair.source, pair.target);
  return result;
}

}  // namespace gpureg
