// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "records/map_run.hpp"

namespace gpureg::cli {

/// Writes map.html: one self-contained page with the map in 3-D, its graph, and what was left out
/// and why.
/// @throws IoError.
void write_map_page(const MapRun& run);

}  // namespace gpureg::cli
