// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <vector>

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

std::string list_of_verbs(const CLI::App& app) {
  std::string list;
  for (const CLI::App* verb : app.get_subcommands(nullptr))
    list += (list.empty() ? "" : ", ") + verb->get_name();
  return list;
}

// CLI11's own words for a misspelt verb or option do not always name it.
std::string what_is_wrong(const CLI::App& app, const CLI::ParseError& error, int argc,
                          char** argv) {
  const auto chosen = app.get_subcommands();
  if (chosen.empty()) {
    const std::string first = argc > 1 ? argv[1] : "";
    return (first.empty() ? std::string("no verb given") : "there is no verb " + first) +
           "; verbs: " + list_of_verbs(app) + " (see `gpureg --help`)";
  }
  const std::string help = " (see `gpureg " + chosen.front()->get_name() + " --help`)";
  const std::vector<std::string> unknown = app.remaining(true);
  if (dynamic_cast<const CLI::ExtrasError*>(&error) == nullptr || unknown.empty())
    return error.what() + help;
  const auto option = std::find_if(unknown.begin(), unknown.end(),
                                   [](const std::string& text) { return text.rfind("-", 0) == 0; });
  return option == unknown.end() ? "unexpected argument " + unknown.front() + help
                                 : "unknown option " + *option + help;
}

int run(int argc, char** argv) {
  CLI::App app{"Global registration of point clouds, on the CPU and on the GPU.", "gpureg"};
  app.set_version_flag("--version", "gpureg " GPUREG_VERSION);
  app.require_subcommand(1);
  // Verbs take it over when they are added.
  app.footer(
      "Exit status: 0 aligned or done, 1 no alignment found, 2 bad usage or input, 130 "
      "interrupted.");
  Action action;
  add_register(app, action);
  add_batch(app, action);
  add_consistency(app, action);
  add_reconstruct(app, action);
  add_calibrate(app, action);
  add_evaluate(app, action);
  add_evaluate_trajectory(app, action);
  add_evaluate_surface(app, action);
  add_report(app, action);
  add_generate(app, action);
  add_info(app, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // Help and version come as exceptions, too.
    if (error.get_exit_code() == 0) return finish(app.exit(error));
    return fail(what_is_wrong(app, error, argc, argv));
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
