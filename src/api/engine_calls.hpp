// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "pipeline/engine.hpp"

/// Calls of an engine for any number of pairs, in parts as limits and memory allow. The poses of
/// 2-D scans that they return lie in the plane, and so does their evidence.
namespace gpureg {

/// Aligns all pairs.
void align_all(Engine& engine, Span<const PairInput> pairs, const RegistrationSettings& options,
               Span<PairOutcome> outcomes);

/// Verifies given poses of the pairs; refine: they are refined before.
std::vector<PairOutcome> verify_all(Engine& engine, const std::vector<PairInput>& pairs,
                                    const std::vector<std::vector<Pose<double>>>& poses,
                                    const RegistrationSettings& options, bool refine);

}  // namespace gpureg
