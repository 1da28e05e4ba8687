// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "localization/search.hpp"

namespace gpureg::localization {

/// Sets `planned` of the scans: the places of the map that look most like the scan from above, the
/// most confident first. Correlative scan matching of walls (algorithm/plan.hpp) for each direction
/// of the scan that may be the map's vertical: all cells and headings are tried, coarse cells first.
/// Heights follow from the columns of the best cells.
void search_plan(const Context& context, const MapState& map, std::size_t most,
                 std::vector<Scan>& scans);

}  // namespace gpureg::localization
