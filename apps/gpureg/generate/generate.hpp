// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "command_line.hpp"

namespace gpureg::cli {

void add_generate(CommandLine& line);

}  // namespace gpureg::cli
