// SPDX-License-Identifier: BSD-3-Clause
// The verbs of scripts/quickstart.
#include "command.hpp"
#include "program.hpp"

namespace {

void add_verbs(gpureg::cli::CommandLine& line) {
  gpureg::cli::add_batch(line);
  gpureg::cli::add_evaluate(line);
  gpureg::cli::add_report(line);
}

}  // namespace

int main(int argc, char** argv) { return gpureg::cli::run_program(argc, argv, add_verbs); }
