// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace gpureg::test {

/// What a command did: exit status (128 + signal where it was killed), and standard output with
/// standard error in one text.
struct Outcome {
  int status = 0;
  std::string output;
};

/// Runs a program with these arguments, without a shell in between, and waits for it. Throws
/// std::runtime_error where it cannot be started.
Outcome run_command(const std::vector<std::string>& arguments);

}  // namespace gpureg::test
