// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/reconstruction/audit.hpp"

namespace gpureg::reconstruction {

/// Sets Edge::map_confidence: edges that agree with the map are as certain as the weakest
/// connection between their scans, edges that differ from it are as likely as that connection is
/// wrong, and edges between islands were not certain enough to join them.
/// @param max_error RMS distance over the overlap up to which an edge agrees, metres.
void judge_edges(const Audit& audit, double max_error, Reconstruction& map);

}  // namespace gpureg::reconstruction
