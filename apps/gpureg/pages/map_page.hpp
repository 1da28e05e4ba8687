// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "run/map_run.hpp"

namespace gpureg::cli {

/// Writes map.html: one self-contained page with the map in 3-D, its graph, and what was left out
/// and why.
/// @param surfaces one per scan; those of scans that are left out may be empty.
/// @throws IoError.
void write_map_page(const MapRun& run, const std::vector<reconstruction::Surface>& surfaces);

}  // namespace gpureg::cli
