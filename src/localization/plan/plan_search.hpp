// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "localization/search.hpp"

namespace gpureg::localization {

/// Of an upright scan: coarse cells that are looked at, places of these that are refined, and
/// refined places that get heights; and how many times as wide as usual the kernel of a refinement
/// is that goes before the usual one of a verification, 0: none.
struct PlanEffort {
  std::size_t cells, refined, with_heights;
  float first_kernel;
};
/// Enough for most scans; and for those in rooms, which fit thousands of places of large maps, and
/// sparse ones, whose poses converge slowly.
constexpr PlanEffort kUsualEffort{8192, 256, 128, 0}, kThoroughEffort{131072, 32768, 16384, 4};

/// Sets `planned` of the scans: the places of the map that look most like the scan from above, the
/// most confident first. Correlative scan matching of walls (algorithm/plan.hpp) for each direction
/// of the scan that may be the map's vertical: all cells and headings are tried, coarse cells
/// first. Heights follow from the columns of the best cells.
void search_plan(const Context& context, const MapState& map, std::size_t most,
                 const PlanEffort& effort, const std::vector<Scan*>& scans);

}  // namespace gpureg::localization
