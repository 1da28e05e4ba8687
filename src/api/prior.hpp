// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/prior.hpp"
#include "gpureg/prior.hpp"
#include "pipeline/engine.hpp"

namespace gpureg {

/// The prior as the stages ask it. swapped: the target is moved, being the smaller cloud.
PriorTest prior_test(const RegistrationPrior& prior, const PreparedState& source,
                     const PreparedState& target, bool swapped);

}  // namespace gpureg
