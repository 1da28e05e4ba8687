// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "api/aligned_pair.hpp"
#include "gpureg/result.hpp"

namespace gpureg {

/// Converts an outcome to the public result in the frames of the clouds.
RegistrationResult to_result(PairOutcome outcome, const AlignedPair& pair,
                             const PriorTest& prior = {});

/// The same between the rows of both clouds, without their origins (PointCloudView::origin).
RegistrationResult to_row_result(PairOutcome outcome, const AlignedPair& pair,
                                 const PriorTest& prior = {});

}  // namespace gpureg
