// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <string>

#include "command.hpp"
#include "gpureg/error.hpp"

namespace gpureg::cli {
namespace {

// One line, whatever the message has inside: scripts read stderr by lines.
int fail(std::string message) {
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::cerr << "gpureg: " << message << std::endl;
  return kBadInput;
}

int finish(int status) {
  std::cout.flush();
  return std::cout ? status : fail("cannot write to standard output");
}

int run(int argc, char** argv) {
  CLI::App app{"Global registration of point clouds, on the CPU and on the GPU.", "gpureg"};
  app.set_version_flag("--version", "gpureg " GPUREG_VERSION);
  app.require_subcommand(1);
  Action action;
  add_register(app, action);
  add_batch(app, action);
  add_evaluate(app, action);
  add_report(app, action);
  add_generate(app, action);
  add_info(app, action);
  // Last, as verbs inherit it.
  app.footer(
      "Exit status: 0 aligned or done, 1 no alignment found, 2 bad usage or input, 130 "
      "interrupted.\n"
      "`gpureg VERB --help` explains a verb.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version come as exceptions, too.
    if (error.get_exit_code() == 0) return finish(app.exit(error));
    return fail(std::string(error.what()) + " (see `gpureg --help`)");
  }
  return finish(action());
}

}  // namespace
}  // namespace gpureg::cli

int main(int argc, char** argv) {
  // Writing to a closed pipe or past a size limit shall be an error with a message, not a death.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    return gpureg::cli::run(argc, argv);
  } catch (const std::bad_alloc&) {
    return gpureg::cli::fail("out of memory");
  } catch (const std::exception& error) {
    return gpureg::cli::fail(error.what());
  }
}
