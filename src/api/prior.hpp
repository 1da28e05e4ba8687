// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/prior.hpp"
#include "gpureg/prior.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

/// Converts the prior for the stages. swapped: the engine moves the target, the smaller cloud.
PriorTest prior_test(const RegistrationPrior& prior, const PreparedState& source,
                     const PreparedState& target, bool swapped);

}  // namespace gpureg
