// SPDX-License-Identifier: BSD-3-Clause
#include "program.hpp"

#include <algorithm>
#include <csignal>
#include <exception>
#include <iostream>
#include <new>
#include <string>

#include "exit_status.hpp"
#include "option_names.hpp"

namespace gpureg::cli {
namespace {

// One line, whatever the message has inside: scripts read stderr by lines.
int fail(const std::string& what) {
  std::string message = in_option_names(what);
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::cerr << "gpureg: " << message << std::endl;
  return kBadInput;
}

int finish(int status) {
  std::cout.flush();
  return std::cout ? status : fail("cannot write to standard output");
}

}  // namespace

int run_program(int argc, char** argv, void (*add_verbs)(CommandLine&)) {
  // Writing to a closed pipe or past a size limit shall be an error with a message, not a death.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    CommandLine line("gpureg", "Global registration of point clouds, on the CPU and on the GPU.",
                     "gpureg " GPUREG_VERSION);
    add_verbs(line);
    return finish(line.run(argc, argv));
  } catch (const std::bad_alloc&) {
    return fail("out of memory");
  } catch (const std::exception& error) {
    return fail(error.what());
  }
}

}  // namespace gpureg::cli
