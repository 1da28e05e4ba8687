// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "confidence/confidence.hpp"
#include "gpureg/verification.hpp"

/// Whether a scan is at a place of a map: two regressions (place_confidence_model.hpp), for places
/// that the plan of the map proposes and for those of its tiles. Fitted together with the share of
/// every place and of none (shared_probability()) by bench/localization/fit_places.py.
namespace gpureg::localization {

/// Inputs of the regressions. A larger value never speaks against the place. Those that begin with
/// `nothing` and `no` are minus the logarithm of the named share of points.
enum class PlaceFeature : std::uint8_t {
  nothing_uncovered,      ///< points of the scan without a surface of the map
  no_map_in_free_space,   ///< map in free space of the scan
  no_scan_in_free_space,  ///< scan in free space of the map
  no_map_in_front,        ///< map close in front of surfaces of the scan
  no_scan_in_front,       ///< scan close in front of surfaces of the map
  no_scan_behind,         ///< scan behind surfaces of the map
  no_scan_far_in_front,   ///< scan farther in front of surfaces of the map
  log_weighted_overlap,   ///< of the scan, by directions of normals
  search_log_odds,        ///< of the search that proposed the place
  pair_log_odds,          ///< of a place of a tile: as a pair
  log_match_inliers,      ///< likewise
  lead,                   ///< over the best place elsewhere
  count
};

constexpr std::size_t kPlaceFeatures = static_cast<std::size_t>(PlaceFeature::count);
using PlaceFeatures = std::array<double, kPlaceFeatures>;

/// What tells whether a scan is at a place.
struct PlaceEvidence {
  PlaceFeatures features{};            ///< without the lead
  confidence::OverlapCount covered{};  ///< points of the scan that lie on the map
};

/// Of a place that the plan of the map proposes.
/// @param searched confidence of the search.
/// @param points of the scan.
PlaceEvidence planned_evidence(double searched, const PoseVerification& place, std::size_t points);

/// Of a place that a tile proposes.
/// @param wide the same place in voxels of the search, or a verification without any: sparse scans
///   are contained in wide voxels at least.
PlaceEvidence tile_evidence(double searched, const PoseVerification& fine,
                            const PoseVerification& wide, std::size_t points);

/// By the surfaces of a place alone, whatever proposed it.
double confidence_of_surfaces(const PoseVerification& place);

/// Probability that the scan is at each place rather than nowhere, other places aside but for the
/// lead over them.
/// @param same whether two places, by index, are one: no rivals.
std::vector<double> place_confidences(const std::vector<PlaceEvidence>& places, bool planned,
                                      const std::function<bool(std::size_t, std::size_t)>& same);

}  // namespace gpureg::localization
