// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "api/access.hpp"
#include "gpureg/registration.hpp"
#include "settings/settings.hpp"

/// Checks of the caller's pairs.
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

}  // namespace gpureg
