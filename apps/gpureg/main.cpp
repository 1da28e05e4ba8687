// SPDX-License-Identifier: BSD-3-Clause
#include "command.hpp"
#include "program.hpp"
#include "verbs/audit.hpp"
#include "verbs/generate.hpp"

namespace {

using namespace gpureg::cli;

void add_verbs(CommandLine& line) {
  add_register(line);
  add_batch(line);
  add_consistency(line);
  add_reconstruct(line);
  add_locate(line);
  add_find(line);
  add_change(line);
  add_audit(line);
  add_calibrate(line);
  add_evaluate(line);
  add_evaluate_trajectory(line);
  add_evaluate_surface(line);
  add_report(line);
  add_view(line);
  line.program("generate", "Make a synthetic scene in Redwood's layout, with its truth",
               become_generator);
  add_info(line);
}

}  // namespace

int main(int argc, char** argv) { return run_program(argc, argv, add_verbs); }
