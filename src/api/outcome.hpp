// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/result.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

/// Converts an outcome to the public result in the frames of the clouds. swapped: the engine moved
/// the target of the pair.
RegistrationResult to_result(const PairOutcome& outcome, const PreparedState& source,
                             const PreparedState& target, bool swapped,
                             const RegistrationOptions& options, const PriorTest& prior = {});

/// The same between the rows of both clouds, without their origins (PointCloudView::origin).
RegistrationResult to_row_result(const PairOutcome& outcome, const PreparedState& source,
                                 const PreparedState& target, bool swapped,
                                 const RegistrationOptions& options, const PriorTest& prior = {});

}  // namespace gpureg
