// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "gpureg/result.hpp"

namespace gpureg {

/// Orders the modes of one pair by how much speaks for them, drops those that are the same as a better one, and fills in their confidence
/// from the evidence of all of them.
void set_confidences(std::vector<RegistrationMode>& modes, const std::function<bool(const RegistrationMode&, const RegistrationMode&)>& same);

}  // namespace gpureg
