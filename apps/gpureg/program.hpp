// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "command_line.hpp"

namespace gpureg::cli {

/// The body of main(): parses the arguments, runs the verb, prints errors as one line.
/// @return exit status.
int run_program(int argc, char** argv, void (*add_verbs)(CommandLine&));

}  // namespace gpureg::cli
