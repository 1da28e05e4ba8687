// SPDX-License-Identifier: BSD-3-Clause
// gpureg-generate OUT: what `gpureg generate OUT` runs.
#include <vector>

#include "generate/generate.hpp"
#include "program.hpp"

int main(int argc, char** argv) {
  char verb[] = "generate";
  std::vector<char*> arguments(argv, argv + argc + 1);  // with the null at the end
  arguments.insert(arguments.begin() + 1, verb);
  return gpureg::cli::run_program(argc + 1, arguments.data(), gpureg::cli::add_generate);
}
