// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "localization/place_confidence.hpp"
#include "localization/search.hpp"

namespace gpureg::localization {

/// Confidence of a place from which the coarse search is enough, and one of its poses, not verified
/// yet, that a search in narrower voxels hardly surpasses.
constexpr double kSure = 0.75, kSureSearch = 0.95;
/// Where no pose of the coarse search reaches this confidence, the scan is not in the map, if its
/// coarse points are so many that the search had something to see.
constexpr double kHopelessSearch = 0.1;
/// A candidate in all of the map around it.
struct Verified {
  Candidate candidate;
  PoseVerification verification;
  std::size_t points = 0;  ///< of the neighbourhood
  PlaceEvidence evidence;
  double confidence = 0;  ///< other places aside
};

/// Verifies the candidates of scans, which the plan of the map proposes, by the surfaces of all of
/// the map around them, without features; the most confident of each scan first.
/// @param first_kernel see PlanEffort.
std::vector<std::vector<Verified>> verify_planned(const Context& context, const MapState& map,
                                                  const LocateSettings& options, float first_kernel,
                                                  const std::vector<Scan*>& scans);

/// Verifies the candidates of a scan against all of the map around them; the most confident first.
/// @param before candidates of the scan that were verified already.
std::vector<Verified> verify_places(const Context& context, const MapState& map,
                                    const LocateSettings& options, const Scan& scan,
                                    const std::vector<Verified>& before = {});

}  // namespace gpureg::localization
