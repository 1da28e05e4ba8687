// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "command_line.hpp"

namespace gpureg::cli {

/// Adds `gpureg audit`.
void add_audit(CommandLine& line);

}  // namespace gpureg::cli
