// SPDX-License-Identifier: BSD-3-Clause
#include "confidence/features.hpp"
#include "math/exponential.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

namespace gpureg::confidence {
namespace {

/// Shares and counts below these are as good as none: they bound the logarithms.
constexpr double kMinMatchSupport = 1e-5, kMinMatchInliers = 1, kMinOverlap = 1e-3;
constexpr double kMinEigenvalue = 1e-2, kMinViolation = 3e-3, kMinViolationOfAll = 1e-3;
constexpr double kMinFrontViolation = 1e-3, kMinBehindSurface = 1e-3;
/// Noise and edges leave a few points of a hundred uncovered in any scan.
constexpr double kMinUncovered = 2e-2;
/// Real rooms are full of things that one cloud observed and the other one did not look at. Where
/// free space is known, a sum of front violations of both sides below this tells which mode is the
/// better one, and not whether it is correct.
constexpr double kMinVerifiedFrontViolation = 2e-2;
/// A model has what the scan saw through: things that were moved, or are not there yet.
constexpr double kMinModelViolation = 1e-2;
/// Normals of noisy scans of machined parts agree with those of the model to this part and more.
constexpr double kNoisyOverlap = 0.4;
/// Bounds the denominators of shares.
constexpr double kMinDenominator = 1e-6;
/// Bounds the log odds as features: beyond, modes are certain one way or the other.
constexpr double kMaxLogOdds = 14;
/// Bounds the odds of the share: no mode is ten thousand times as likely as all others together.
constexpr double kMinOthers = 1e-4;

double log_at_least(double value, double least) { return portable::log(std::max(value, least)); }

double safe_share(double part, double whole) { return part / std::max(whole, kMinDenominator); }

/// The value of both sides.
struct Sides {
  double source, target;
  double lower() const { return std::min(source, target); }
  double higher() const { return std::max(source, target); }
  double sum() const { return source + target; }
};

class Setter {
 public:
  explicit Setter(Features& features) : features_(features) {}
  void operator()(Feature feature, double value) {
    features_[static_cast<std::size_t>(feature)] = value;
  }

 private:
  Features& features_;
};

void add_overlap(const PoseEvidence& e, Setter& set) {
  const Sides overlap{e.source_overlap, e.target_overlap};
  const Sides weighted{e.source_normal_weighted_overlap, e.target_normal_weighted_overlap};
  double volume = 0;
  for (const double value : e.information_eigenvalues) volume += portable::log1p(value);
  set(Feature::log_match_support, log_at_least(e.match_support, kMinMatchSupport));
  set(Feature::log_match_inliers, log_at_least(e.match_inliers, kMinMatchInliers));
  set(Feature::log_lower_weighted_overlap, log_at_least(weighted.lower(), kMinOverlap));
  set(Feature::log_higher_weighted_overlap, log_at_least(weighted.higher(), kMinOverlap));
  set(Feature::log_lower_overlap, log_at_least(overlap.lower(), kMinOverlap));
  set(Feature::log_first_eigenvalue, log_at_least(e.information_eigenvalues[0], kMinEigenvalue));
  set(Feature::log_second_eigenvalue, log_at_least(e.information_eigenvalues[1], kMinEigenvalue));
  set(Feature::log_third_eigenvalue, log_at_least(e.information_eigenvalues[2], kMinEigenvalue));
  set(Feature::information_volume, volume);
}

void add_free_space(const PoseEvidence& e, Setter& set) {
  // Where only one cloud's viewpoints are known, its observations stand for both sides.
  const bool source = e.source_observed > 0, target = e.target_observed > 0;
  const auto both = [&](double s, double t) { return Sides{source ? s : t, target ? t : s}; };
  const Sides observed = both(e.source_observed, e.target_observed);
  const Sides violation = both(e.source_free_space_violation, e.target_free_space_violation);
  const Sides occluded = both(e.source_occluded, e.target_occluded);
  const Sides of_all{observed.source * violation.source, observed.target * violation.target};
  set(Feature::lower_observed, observed.lower());
  set(Feature::higher_observed, observed.higher());
  set(Feature::higher_violation_of_all, of_all.higher());
  set(Feature::lower_violation_of_all, of_all.lower());
  set(Feature::higher_violation, violation.higher());
  set(Feature::lower_violation, violation.lower());
  set(Feature::log_higher_violation, log_at_least(violation.higher(), kMinViolation));
  set(Feature::lower_occluded, occluded.lower());
  set(Feature::log_violation_of_all, log_at_least(of_all.sum(), kMinViolationOfAll));
}

void add_surface_sides(const PoseEvidence& e, bool free_space, Regressand regressand, Setter& set) {
  const Sides any_normal{e.source_overlap_any_normal, e.target_overlap_any_normal};
  // Share of the points within the distance whose normals agree: the same side of the surface.
  const Sides normal_agreement{safe_share(e.source_overlap, any_normal.source),
                               safe_share(e.target_overlap, any_normal.target)};
  const Sides near_surface{e.source_near_surface, e.target_near_surface};
  const Sides front_near{e.source_front_violation_near, e.target_front_violation_near};
  const bool verified = free_space && regressand == Regressand::confidence;
  set(Feature::log_front_violation_near,
      log_at_least(front_near.sum(), verified ? kMinVerifiedFrontViolation : kMinFrontViolation));
  set(Feature::lower_normal_agreement, normal_agreement.lower());
  set(Feature::higher_normal_agreement, normal_agreement.higher());
  set(Feature::higher_near_surface, near_surface.higher());
  set(Feature::lower_near_surface, near_surface.lower());
  const Sides front_far{e.source_front_violation_far, e.target_front_violation_far};
  const Sides behind{e.source_behind_surface, e.target_behind_surface};
  const auto of_near = [&](const Sides& part) {
    return Sides{safe_share(part.source, part.source + any_normal.source),
                 safe_share(part.target, part.target + any_normal.target)};
  };
  const Sides front_share =
      of_near({front_near.source + front_far.source, front_near.target + front_far.target});
  const Sides behind_share = of_near(behind);
  set(Feature::log_front_violation_far, log_at_least(front_far.sum(), kMinFrontViolation));
  set(Feature::higher_front_share, front_share.higher());
  set(Feature::lower_front_share, front_share.lower());
  set(Feature::log_behind_surface, log_at_least(behind.sum(), kMinBehindSurface));
  set(Feature::higher_behind_share, behind_share.higher());
  set(Feature::lower_behind_share, behind_share.lower());
}

/// A scan lies on its model as a whole, and is the better covered side: the model has a back, and
/// more of everything. Where the scan saw through a part of the model, it is of something else.
/// Matches of features tell little: those of machined parts are few, and many by chance.
void add_containment(const PoseEvidence& e, Regressand regressand, Setter& set) {
  const Sides covered{e.source_overlap_any_normal, e.target_overlap_any_normal};
  set(Feature::log_uncovered, log_at_least(1 - covered.higher(), kMinUncovered));
  // How well normals agree depends on the noise of the scan, and tells which pose is the better
  // one; whether it is correct, only where they hardly agree.
  const Sides weighted{e.source_normal_weighted_overlap, e.target_normal_weighted_overlap};
  const bool ranked = regressand == Regressand::ranking;
  set(Feature::log_higher_weighted_overlap,
      log_at_least(ranked ? weighted.higher() : std::min(weighted.higher(), kNoisyOverlap),
                   kMinOverlap));
  if (ranked) return;
  const Sides violation{e.source_free_space_violation, e.target_free_space_violation};
  set(Feature::log_higher_violation, log_at_least(violation.higher(), kMinModelViolation));
}

constexpr const char* kNames[] = {"log_match_support",
                                  "log_match_inliers",
                                  "log_lower_weighted_overlap",
                                  "log_higher_weighted_overlap",
                                  "log_lower_overlap",
                                  "log_first_eigenvalue",
                                  "log_second_eigenvalue",
                                  "log_third_eigenvalue",
                                  "information_volume",
                                  "lower_observed",
                                  "higher_observed",
                                  "higher_violation_of_all",
                                  "lower_violation_of_all",
                                  "higher_violation",
                                  "lower_violation",
                                  "log_higher_violation",
                                  "lower_occluded",
                                  "log_violation_of_all",
                                  "log_front_violation_near",
                                  "lower_normal_agreement",
                                  "higher_normal_agreement",
                                  "higher_near_surface",
                                  "lower_near_surface",
                                  "log_front_violation_far",
                                  "higher_front_share",
                                  "lower_front_share",
                                  "log_behind_surface",
                                  "higher_behind_share",
                                  "lower_behind_share",
                                  "log_uncovered",
                                  "log_odds",
                                  "margin",
                                  "distinct_share",
                                  "share",
                                  "rival_match_inliers",
                                  "third_match_inliers",
                                  "rival_match_support",
                                  "rival_weighted_overlap",
                                  "match_inliers_lead",
                                  "match_support_lead",
                                  "weighted_overlap_lead"};
static_assert(std::size(kNames) == kFeatureCount, "a name for each feature");

}  // namespace

const char* to_string(Feature feature) { return kNames[static_cast<std::size_t>(feature)]; }

AvailableEvidence available_evidence(const std::vector<PoseEvidence>& modes, ViewpointSource source,
                                     ViewpointSource target) {
  // A mode without overlap does not show which evidence the clouds have.
  AvailableEvidence available;
  for (const PoseEvidence& e : modes) {
    available.free_space |= e.source_observed > 0 || e.target_observed > 0;
    available.surface_sides |= e.source_near_surface > 0 && e.target_near_surface > 0;
  }
  available.model = with_model(source, target);
  return available;
}

Features features_of(const PoseEvidence& evidence, AvailableEvidence available,
                     Regressand regressand) {
  Features features{};
  Setter set(features);
  if (available.model) {
    add_containment(evidence, regressand, set);
    return features;
  }
  add_overlap(evidence, set);
  if (available.free_space) add_free_space(evidence, set);
  if (available.surface_sides) add_surface_sides(evidence, available.free_space, regressand, set);
  return features;
}

void add_rank(const std::vector<double>& log_odds, const std::vector<Features>& own,
              std::size_t mode, std::uint32_t refined, Features& features) {
  const auto bounded = [&](std::size_t k) {
    return std::clamp(log_odds[k], -kMaxLogOdds, kMaxLogOdds);
  };
  double alternative = -kMaxLogOdds, others = 0;
  for (std::size_t k = 0; k < log_odds.size(); ++k) {
    if (k == mode) continue;
    alternative = std::max(alternative, bounded(k));
    others += portable::exp(std::min(log_odds[k] - log_odds[mode], kMaxLogOdds));
  }
  Setter set(features);
  set(Feature::log_odds, bounded(mode));
  set(Feature::margin, bounded(mode) - alternative);
  set(Feature::distinct_share, static_cast<double>(log_odds.size()) / refined);
  set(Feature::share, -log_at_least(others, kMinOthers));
  // The best of the others by one term.
  const auto best = [&](Feature feature, std::size_t rank, double none) {
    std::vector<double> values;
    for (std::size_t k = 0; k < own.size(); ++k)
      if (k != mode) values.push_back(own[k][static_cast<std::size_t>(feature)]);
    if (values.empty()) return none;
    rank = std::min(rank, values.size() - 1);
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank),
                     values.end(), std::greater<>());
    return values[rank];
  };
  const auto rival = [&](Feature feature, double none, Feature of_rival, Feature lead) {
    const double found = best(feature, 0, none);
    set(of_rival, found);
    set(lead, own[mode][static_cast<std::size_t>(feature)] - found);
  };
  rival(Feature::log_match_inliers, 0, Feature::rival_match_inliers, Feature::match_inliers_lead);
  rival(Feature::log_match_support, portable::log(kMinMatchSupport), Feature::rival_match_support,
        Feature::match_support_lead);
  rival(Feature::log_lower_weighted_overlap, portable::log(kMinOverlap),
        Feature::rival_weighted_overlap, Feature::weighted_overlap_lead);
  set(Feature::third_match_inliers, best(Feature::log_match_inliers, 2, 0));
}

}  // namespace gpureg::confidence
