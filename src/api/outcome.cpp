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

/// Makes the result of one pair out of what the engine measured: drops the poses that the pair
/// forbids, ranks the others, and says what follows from the best one.
class Conclusion {
 public:
  Conclusion(PairOutcome outcome, const AlignedPair& pair)
      : outcome_(std::move(outcome)), pair_(pair), options_(pair.options) {}

  RegistrationResult result(const PriorTest& prior) && {
    const bool contradicted = drop_forbidden_modes(prior);
    describe_pair();
    if (options_.method == RegistrationMethod::quadruples) {
      if (outcome_.has_pose) take_pose();
    } else if (pair_.source.plane.exists() != pair_.target.plane.exists() &&
               pair_.source.size > 0 && pair_.target.size > 0) {
      result_.reason = RegistrationReason::flat_with_solid;
    } else {
      if (!outcome_.modes.empty()) {
        collect_modes();
        rank_modes();
        take_best_mode();
      }
      result_.reason = evidence_reason(contradicted);
      // A pose under which nothing overlaps is no candidate. Its confidence is 0.
      if (result_.reason != RegistrationReason::none && result_.statistics.inliers == 0) {
        result_.target_from_source = no_pose();
        result_.modes.clear();
      }
    }
    set_status();
    return std::move(result_);
  }

 private:
  /// Refinement moves poses, so they are asked again. Nothing speaks against a 2-D scan that it
  /// moved to where nothing overlaps.
  /// @return whether no mode is left and the prior, or the plane of the scans, has refused some.
  bool drop_forbidden_modes(const PriorTest& prior) {
    bool refused_some = false;
    const auto forbidden = [&](const ModeOutcome& m) {
      const bool refused =
          !permitted(prior, to_rigid(m.pose)) || (pair_.flat() && confidence::without_overlap(m));
      refused_some |= refused;
      return refused || pair_.contradicts_common_view(m);
    };
    outcome_.modes.erase(std::remove_if(outcome_.modes.begin(), outcome_.modes.end(), forbidden),
                         outcome_.modes.end());
    return outcome_.modes.empty() && refused_some;
  }

  /// What does not depend on the pose.
  void describe_pair() {
    result_.reason = outcome_.reason;
    result_.statistics = outcome_.statistics;
    result_.timings = outcome_.timings;
    result_.source_viewpoint = pair_.source.statistics.viewpoint;
    result_.target_viewpoint = pair_.target.statistics.viewpoint;
    result_.statistics.swapped = pair_.swapped;
    result_.flat = pair_.flat();
    result_.voxel_size = pair_.target.options.unit;
    if (!pair_.swapped) return;
    std::swap(result_.statistics.source_points, result_.statistics.target_points);
    if (result_.reason == RegistrationReason::too_few_source_points)
      result_.reason = RegistrationReason::too_few_target_points;
    else if (result_.reason == RegistrationReason::too_few_target_points)
      result_.reason = RegistrationReason::too_few_source_points;
  }

  /// The pose of the quadruples.
  void take_pose() {
    result_.target_from_source = pair_.transform_of(outcome_.pose);
    result_.inlier_ratio = result_.confidence = pipeline::inlier_ratio(outcome_.statistics);
    result_.inlier_rmse = pair_.rmse(outcome_.support.residual, outcome_.support.inliers);
    result_.source_moments = pair_.source_moments(outcome_);
    result_.target_moments = pair_.target_moments(outcome_);
  }

  /// The modes in the caller's order of the clouds.
  void collect_modes() {
    const std::vector<PoseEvidence> evidence = pair_.evidence_of(outcome_);
    for (std::size_t k = 0; k < outcome_.modes.size(); ++k) {
      const ModeOutcome& mode = outcome_.modes[k];
      RegistrationMode out;
      out.target_from_source = pair_.transform_of(mode.pose);
      // A perturbed pose within the correspondence distance of its origin is that mode, less well
      // refined; evidence cannot separate poses that close. On a model it stands for the mode where
      // it fits better.
      const auto [origin, is_first] = origins_.emplace(mode.origin_mode, k);
      const bool at_origin =
          !is_first && distance_between(out.target_from_source,
                                        pair_.transform_of(outcome_.modes[origin->second].pose),
                                        origin_moments(mode.origin_mode)) <=
                           static_cast<double>(options_.prepare.max_correspondence_distance);
      if (at_origin && !pair_.with_model()) continue;
      out.evidence = evidence[k];
      out.rank_before_refinement = static_cast<std::uint32_t>(k);
      modes_.push_back(out);
      at_origin_.push_back(at_origin);
    }
    middle_ = middle_of(pair_.source_moments(outcome_.modes.front()), origin_of(pair_.source));
  }

  /// Ranks the modes by their evidence, keeps one of those that equal each other, and fills in the
  /// confidences.
  void rank_modes() {
    std::vector<PoseEvidence> evidence;
    for (const RegistrationMode& mode : modes_) evidence.push_back(mode.evidence);
    const confidence::Ranking ranking = pair_.ranking_of(evidence);
    std::vector<RegistrationMode>& out = result_.modes;
    std::vector<confidence::RankedMode> distinct;
    for (const Group& group : groups_of(ranking)) {
      out.push_back(modes_[group.kept]);
      const RegistrationMode& likeliest = modes_[group.likeliest];
      distinct.push_back({likeliest.evidence, ranking.log_odds[group.likeliest],
                          pair_.overlap_of(outcome_of(likeliest))});
    }
    auto confidences =
        confidence::confidences_of(distinct, ranking.available, options_.evidence.modes);
    set_confidences(confidences);
    mark_equivalents(distinct);
    std::vector<bool> equivalent;
    for (const RegistrationMode& mode : out) equivalent.push_back(mode.equivalent);
    confidence::calibrate_modes(options_.calibration, equivalent, confidences);
    set_confidences(confidences);
  }

  /// Poses that equal each other, by their indices in modes_.
  struct Group {
    std::size_t likeliest;  ///< has the confidence of all, which was fitted to the likeliest poses
    std::size_t kept;       ///< stands for all
  };

  /// In descending order of their log odds. The likeliest pose of a group is kept, or on a model
  /// the one of similar odds that fits best.
  std::vector<Group> groups_of(const confidence::Ranking& ranking) const {
    std::vector<Group> groups;
    const auto group_of = [&](std::size_t k) {
      return std::find_if(groups.begin(), groups.end(), [&](const Group& group) {
        return same(modes_[group.likeliest], modes_[k]);
      });
    };
    for (const std::size_t k : ranking.order)
      if (!at_origin_[k] && group_of(k) == groups.end()) groups.push_back({k, k});
    if (!ranking.available.model) return groups;
    for (const std::size_t k : ranking.order) {
      const auto group = group_of(k);
      if (group != groups.end() &&
          ranking.log_odds[k] >= ranking.log_odds[group->likeliest] - kSimilarLogOdds &&
          confidence::fits_model_better(modes_[k].evidence, modes_[group->kept].evidence))
        group->kept = k;
    }
    return groups;
  }

  void set_confidences(const std::vector<confidence::ModeConfidence>& from) {
    for (std::size_t k = 0; k < from.size(); ++k) {
      result_.modes[k].confidence = from[k].confidence;
      result_.modes[k].overlap_confidence = from[k].overlap_confidence;
    }
  }

  /// Marks the modes that a symmetry of the larger cloud carries into the first one.
  void mark_equivalents(const std::vector<confidence::RankedMode>& ranked) {
    std::vector<RegistrationMode>& modes = result_.modes;
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

  void take_best_mode() {
    const RegistrationMode& first = result_.modes.front();
    const ModeOutcome& best = outcome_of(first);
    RegistrationStatistics& s = result_.statistics;
    result_.target_from_source = first.target_from_source;
    result_.confidence = first.confidence;
    s.points_scored = best.source.points(Term::tested);
    s.inliers = s.consensus = best.source.points(Term::inliers);
    s.refine_iterations = best.iterations;
    result_.inlier_ratio = pipeline::inlier_ratio(s);
    result_.inlier_rmse = pair_.rmse(best.source);
    result_.source_moments = pair_.source_moments(best);
    result_.target_moments = pair_.target_moments(best);
  }

  RegistrationReason evidence_reason(bool contradicted) const {
    const RegistrationStatistics& s = result_.statistics;
    if (pair_.flat() && outcome_.modes.empty() && s.scored > 0)
      return RegistrationReason::confidence_too_low;
    if (s.source_points < limits::kMinMatches) return RegistrationReason::too_few_source_points;
    if (s.target_points < limits::kMinMatches) return RegistrationReason::too_few_target_points;
    if (s.correspondences < limits::kMinMatches) return RegistrationReason::no_usable_features;
    if (s.scored == 0)
      return diagnose(result_) == RegistrationReason::too_few_points
                 ? RegistrationReason::too_few_points
                 : RegistrationReason::degenerate_geometry;
    if (contradicted) return RegistrationReason::contradicts_prior;
    if (result_.confidence >= options_.min_confidence) return RegistrationReason::none;
    if (result_.symmetry_confidence() < options_.min_confidence) return diagnose(result_);
    return options_.accept_symmetry ? RegistrationReason::none : RegistrationReason::symmetric;
  }

  void set_status() {
    const bool by_evidence = options_.method == RegistrationMethod::compatibility;
    result_.status = result_.reason != RegistrationReason::none ? RegistrationStatus::not_aligned
                     : by_evidence && result_.confidence < options_.min_confidence
                         ? RegistrationStatus::aligned_up_to_symmetry
                         : RegistrationStatus::aligned;
  }

  const ModeOutcome& outcome_of(const RegistrationMode& mode) const {
    return outcome_.modes[mode.rank_before_refinement];
  }

  /// Moments of the source points in correspondences under the origin mode.
  CorrespondenceMoments origin_moments(std::uint32_t origin_mode) const {
    return pair_.source_moments(outcome_.modes[origins_.at(origin_mode)]);
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

  PairOutcome outcome_;
  const AlignedPair& pair_;
  const RegistrationSettings& options_;
  RegistrationResult result_;
  std::map<std::uint32_t, std::size_t> origins_;  ///< first mode of each origin mode
  std::vector<RegistrationMode> modes_;           ///< that may be ranked
  std::vector<bool> at_origin_;  ///< of these: a perturbed pose close to its origin
  Eigen::Vector3d middle_;       ///< centre of the source points in correspondences
};

}  // namespace

RegistrationResult to_row_result(PairOutcome outcome, const AlignedPair& pair,
                                 const PriorTest& prior) {
  return Conclusion(std::move(outcome), pair).result(prior);
}

RegistrationResult to_result(PairOutcome outcome, const AlignedPair& pair, const PriorTest& prior) {
  RegistrationResult result = to_row_result(std::move(outcome), pair, prior);
  move_to_frames(result, pair.source, pair.target);
  return result;
}

}  // namespace gpureg
