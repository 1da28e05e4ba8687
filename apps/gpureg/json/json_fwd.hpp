// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace gpureg::cli {

/// Keys stay in the order in which a person would read them.
using Json = nlohmann::ordered_json;

}  // namespace gpureg::cli
