// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/options.hpp"
#include "records/json.hpp"

namespace gpureg::cli {

/// Every option under its name in the API. Floats become their shortest decimal: 0.05, not
/// 0.05000000074.
Json to_json(const RegistrationOptions& options);

}  // namespace gpureg::cli
