// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "gpureg/evidence.hpp"
#include "gpureg/statistics.hpp"

/// Features of the regressions that turn evidence into a confidence. Computed here and nowhere
/// else: bench/accuracy/fit_confidence.py gets them from the library.
namespace gpureg::confidence {

/// An input of the regressions. "Lower" and "higher" are over the two sides of a pair.
enum class Feature : std::uint8_t {
  // Overlap and geometry; of every pair.
  log_match_support,
  log_match_inliers,
  log_lower_weighted_overlap,
  log_higher_weighted_overlap,
  log_lower_overlap,
  log_first_eigenvalue,
  log_second_eigenvalue,
  log_third_eigenvalue,
  information_volume,
  // Free space; where a viewpoint is known.
  lower_observed,
  higher_observed,
  higher_violation_of_all,
  lower_violation_of_all,
  higher_violation,
  lower_violation,
  log_higher_violation,
  lower_occluded,
  log_violation_of_all,
  // Sides of surfaces; where both clouds have them.
  log_front_violation_near,
  lower_normal_agreement,
  higher_normal_agreement,
  higher_near_surface,
  lower_near_surface,
  log_front_violation_far,
  higher_front_share,
  lower_front_share,
  log_behind_surface,
  higher_behind_share,
  lower_behind_share,
  // Containment; where one cloud is a model.
  log_uncovered,
  // The mode among the others of its pair; not for the ranking.
  log_odds,
  margin,
  distinct_share,
  share,  ///< logarithm of the odds that this one of the modes is correct, if one of them is
  // The best of the other modes by one term each, and by how much this one is ahead. In places that
  // repeat, other poses are nearly as good; elsewhere they are not.
  rival_match_inliers,
  third_match_inliers,
  rival_match_support,
  rival_weighted_overlap,
  match_inliers_lead,
  match_support_lead,
  weighted_overlap_lead,
  count
};

constexpr std::size_t kFeatureCount = static_cast<std::size_t>(Feature::count);
using Features = std::array<double, kFeatureCount>;  ///< 0 where a feature does not apply

const char* to_string(Feature feature);

/// Kinds of evidence that the modes of a pair have. They choose the regressions.
struct AvailableEvidence {
  bool free_space = false;
  bool surface_sides = false;
  /// One of the clouds is a model: a closed surface, so that all of the other cloud should lie on
  /// it. Other features than containment and the rank do not apply then.
  bool model = false;
  bool flat = false;  ///< both clouds are scans of 2-D scanners
};

/// modes: of one pair. Free space is available where any mode has an observed point, the sides of
/// surfaces where any mode has points near surfaces of both clouds.
/// @param source, target what was known of the viewpoints of the clouds.
AvailableEvidence available_evidence(const std::vector<PoseEvidence>& modes, ViewpointSource source,
                                     ViewpointSource target);

/// One of the clouds is a model.
inline bool with_model(ViewpointSource source, ViewpointSource target) {
  return source == ViewpointSource::model || target == ViewpointSource::model;
}

/// Purpose of a regression.
enum class Regressand : std::uint8_t {
  ranking,    ///< which mode of a pair is the best
  confidence  ///< whether the best mode is correct
};

/// Features of one mode by its own evidence: all before log_odds.
Features features_of(const PoseEvidence& evidence, AvailableEvidence available,
                     Regressand regressand);

/// Sets the features of a mode among the others of its pair: log_odds and all after it.
/// @param log_odds of all modes of the pair, from rank_modes(), in any order.
/// @param own features_of() all modes, in the same order.
/// @param mode index into both.
/// @param refined largest number of modes that were refined, EvidenceSettings::modes: many distinct
///   ends of the refinement mean that the clouds determine little.
void add_rank(const std::vector<double>& log_odds, const std::vector<Features>& own,
              std::size_t mode, std::uint32_t refined, Features& features);

}  // namespace gpureg::confidence
