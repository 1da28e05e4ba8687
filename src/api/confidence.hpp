// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "gpureg/result.hpp"

namespace gpureg {

/// Fills in the confidence of every mode of one pair from the evidence of all of them.
void set_confidences(std::vector<RegistrationMode>& modes);

}  // namespace gpureg
