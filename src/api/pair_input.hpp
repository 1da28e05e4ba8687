// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "api/access.hpp"
#include "gpureg/registration.hpp"
#include "settings/settings.hpp"

/// From the caller's pairs to those of the engine.
namespace gpureg {

/// The state of a cloud that this context and these options can work with. name: for the message.
/// Throws InvalidArgument.
const PreparedState* checked_state(const Context& context, const PreparedCloud& cloud,
                                   const RegistrationSettings& options, const std::string& name);

/// Checks all pairs and their clouds, so that a long batch does not fail at its last pair. Throws
/// InvalidArgument naming the pair or the cloud.
void check_pairs(const Context& context, const std::vector<PreparedCloud>& clouds,
                 const std::vector<Pair>& pairs, const RegistrationSettings& options);

/// Throws InvalidArgument for clouds whose features cannot be matched.
void check_features(const PreparedState& source, const PreparedState& target);

/// True where the engine moves the caller's target, being the smaller cloud.
bool swaps(const PreparedState& source, const PreparedState& target,
           const RegistrationSettings& options);

/// With the prior, and with the planes of two 2-D scans.
PairInput input_of(const PreparedState& source, const PreparedState& target, bool swapped,
                   const RegistrationPrior& prior = {});

}  // namespace gpureg
