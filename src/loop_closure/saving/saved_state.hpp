// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "loop_closure/state.hpp"

namespace gpureg::loop_closure {

/// The state without clouds and what follows from them, as the content of a file.
std::string to_bytes(const State& state);

/// The inverse. Nodes have no clouds yet.
/// @throws IoError naming the path where the content is no such file, damaged or from a later
///   version.
State from_bytes(const std::string& content, const std::string& path);

}  // namespace gpureg::loop_closure
