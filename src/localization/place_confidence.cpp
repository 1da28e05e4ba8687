// SPDX-License-Identifier: BSD-3-Clause
#include "localization/place_confidence.hpp"

#include <algorithm>

#include "localization/place_confidence_model.hpp"
#include "math/exponential.hpp"

namespace gpureg::localization {
namespace {

/// The logarithms are of at least these shares: less is noise.
constexpr double kLeastUncovered = 0.01, kLeastFreeSpace = 0.002, kLeastBeside = 0.003,
                 kLeastOverlap = 0.02;
/// In free space, of a scan that is not known to have seen through anything.
constexpr double kUnknownFreeSpace = 0.02;
/// Confidences, and their opposites, count as at least these.
constexpr double kLeastSearch = 1e-4, kLeastPair = 1e-3;
/// Places below these log odds are no rivals, and a lead above says no more.
constexpr double kNoRival = -8, kMostLead = 8;

double no(double share, double least) { return -portable::log(std::max(share, least)); }

double logit(double confidence, double least) {
  const double c = std::clamp(confidence, least, 1 - least);
  return portable::log(c / (1 - c));
}

double& at(PlaceFeatures& features, PlaceFeature feature) {
  return features[static_cast<std::size_t>(feature)];
}

PlaceFeatures surface_features(const PoseEvidence& e, double covered) {
  PlaceFeatures out{};
  at(out, PlaceFeature::nothing_uncovered) = no(1 - covered, kLeastUncovered);
  at(out, PlaceFeature::no_map_in_free_space) = no(
      e.target_observed > 0 ? e.target_free_space_violation : kUnknownFreeSpace, kLeastFreeSpace);
  at(out, PlaceFeature::no_scan_in_free_space) = no(e.source_free_space_violation, kLeastFreeSpace);
  at(out, PlaceFeature::no_map_in_front) = no(e.target_front_violation_near, kLeastBeside);
  at(out, PlaceFeature::no_scan_in_front) = no(e.source_front_violation_near, kLeastBeside);
  at(out, PlaceFeature::no_scan_behind) = no(e.source_behind_surface, kLeastBeside);
  at(out, PlaceFeature::no_scan_far_in_front) = no(e.source_front_violation_far, kLeastBeside);
  at(out, PlaceFeature::log_weighted_overlap) =
      -no(e.source_normal_weighted_overlap, kLeastOverlap);
  return out;
}

confidence::OverlapCount count(double share, std::size_t points) {
  return {static_cast<std::uint32_t>(share * static_cast<double>(points)),
          static_cast<std::uint32_t>(points)};
}

double log_odds(const PlaceRegression& regression, const PlaceFeatures& features) {
  double sum = regression.bias;
  for (std::size_t k = 0; k < kPlaceFeatures; ++k) sum += regression.weights[k] * features[k];
  return sum;
}

}  // namespace

PlaceEvidence planned_evidence(double searched, const PoseVerification& place, std::size_t points) {
  const double covered = place.evidence.source_overlap_any_normal;
  PlaceEvidence out{surface_features(place.evidence, covered), count(covered, points)};
  at(out.features, PlaceFeature::search_log_odds) = logit(searched, kLeastSearch);
  return out;
}

PlaceEvidence tile_evidence(double searched, const PoseVerification& fine,
                            const PoseVerification& wide, std::size_t points) {
  const double covered =
      std::max(fine.evidence.source_overlap_any_normal, wide.evidence.source_overlap_any_normal);
  PlaceEvidence out{surface_features(fine.evidence, covered), count(covered, points)};
  at(out.features, PlaceFeature::search_log_odds) = logit(searched, kLeastSearch);
  at(out.features, PlaceFeature::pair_log_odds) =
      logit(std::max(fine.confidence, wide.confidence), kLeastPair);
  at(out.features, PlaceFeature::log_match_inliers) = portable::log1p(fine.evidence.match_inliers);
  return out;
}

double confidence_of_surfaces(const PoseVerification& place) {
  constexpr double kUndecided = 0.5;
  return portable::logistic(
      log_odds(kPlanned.own, planned_evidence(kUndecided, place, 0).features));
}

std::vector<double> place_confidences(const std::vector<PlaceEvidence>& places, bool planned,
                                      const std::function<bool(std::size_t, std::size_t)>& same) {
  const PlaceModel& model = planned ? kPlanned : kOfTiles;
  std::vector<double> own, out;
  for (const PlaceEvidence& place : places)
    own.push_back(std::max(kNoRival, log_odds(model.own, place.features)));
  for (std::size_t k = 0; k < places.size(); ++k) {
    double rival = kNoRival;
    for (std::size_t i = 0; i < places.size(); ++i)
      if (own[i] > rival && !same(k, i)) rival = own[i];
    PlaceFeatures features = places[k].features;
    at(features, PlaceFeature::lead) = std::clamp(own[k] - rival, -kMostLead, kMostLead);
    // A scan beside the map contradicts nothing.
    out.push_back(portable::logistic(log_odds(model.among, features)) *
                  confidence::factor_of(places[k].covered));
  }
  return out;
}

}  // namespace gpureg::localization
