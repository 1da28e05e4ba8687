// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "gpureg/result.hpp"

namespace gpureg {

/// The one that most speaks for; evidence: of the modes of one pair, not empty.
std::size_t likeliest_of(const std::vector<PoseEvidence>& evidence);

/// Orders the modes of one pair by how much speaks for them, drops those that are the same as a better one or of its family (family: one
/// entry for each, see ModeOutcome), and fills in their confidence from the evidence of all of them.
void set_confidences(std::vector<RegistrationMode>& modes, const std::vector<std::uint32_t>& family,
                     const std::function<bool(const RegistrationMode&, const RegistrationMode&)>& same);

}  // namespace gpureg
