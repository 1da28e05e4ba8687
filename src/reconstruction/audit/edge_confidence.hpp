// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/reconstruction/audit.hpp"

namespace gpureg::reconstruction {

/// What is left of the confidence of a pose where places look alike and nothing tells them apart.
double confidence_among_copies(double confidence);

/// Sets Edge::map_confidence: edges that agree with the map are as certain as the weakest
/// connection between their scans, edges that differ from it are as likely as that connection is
/// wrong, and edges between islands were not certain enough to join them.
/// @param options those of the audit: an edge agrees with the map up to the same margin.
/// @param places_look_alike as of AuditedReconstruction.
void judge_edges(const Audit& audit, const AuditOptions& options, bool places_look_alike,
                 Reconstruction& map);

}  // namespace gpureg::reconstruction
