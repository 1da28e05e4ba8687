// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/result.hpp"

namespace gpureg {

/// Orders the modes of one pair by how much speaks for them, and fills in their confidence from the evidence of all of them.
void set_confidences(std::vector<RegistrationMode>& modes);

}  // namespace gpureg
