// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "localization/floor_plan.hpp"
#include "localization/search.hpp"

namespace gpureg::localization {

/// The places of the map that look most like the scan from above: correlative scan matching (Olson,
/// "Real-time correlative scan matching", ICRA 2009) of walls, which agree in the direction that
/// they face, for each direction of the scan that may be the map's vertical. All cells and
/// headings are tried, coarse cells first. Heights follow from the columns of the best cells.
/// @return the most confident first.
std::vector<Candidate> search_plan(const MapState& map, const FloorPlan& plan, const Scan& scan,
                                   std::size_t most, unsigned threads);

}  // namespace gpureg::localization
