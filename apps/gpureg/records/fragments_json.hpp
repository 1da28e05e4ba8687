// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "inputs/scene.hpp"
#include "json/json_fwd.hpp"

namespace gpureg::cli {

/// The fragments of a folder as results list them.
/// @param clouds one per fragment.
Json fragments_json(const FragmentFolder& folder, const std::vector<PreparedCloud>& clouds);

/// Those that were left out, with the reasons; as a line of a summary, empty where there is none.
Json unusable_json(const FragmentFolder& folder);
std::string unusable_line(const FragmentFolder& folder);

}  // namespace gpureg::cli
