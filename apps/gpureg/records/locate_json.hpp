// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "gpureg/localization.hpp"
#include "json/json_fwd.hpp"

namespace gpureg::cli {

/// A scan as an object of the JSON of `gpureg locate`.
Json to_json(const localization::LocateResult& result, const std::string& file);

}  // namespace gpureg::cli
