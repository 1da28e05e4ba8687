// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace gpureg::cli {

/// Exit status of the command. Errors are exceptions up to main(), which turns them into bad_input.
enum ExitStatus { kOk = 0, kNoAlignment = 1, kBadInput = 2, kInterrupted = 130 };

/// Action that main() runs after parsing; returns the exit status.
using Action = std::function<int()>;

/// Each verb adds its subcommand and sets chosen where the command line names it.
void add_register(CLI::App& app, Action& chosen);
void add_batch(CLI::App& app, Action& chosen);
void add_consistency(CLI::App& app, Action& chosen);
void add_reconstruct(CLI::App& app, Action& chosen);
void add_evaluate(CLI::App& app, Action& chosen);
void add_evaluate_trajectory(CLI::App& app, Action& chosen);
void add_evaluate_surface(CLI::App& app, Action& chosen);
void add_report(CLI::App& app, Action& chosen);
void add_generate(CLI::App& app, Action& chosen);
void add_calibrate(CLI::App& app, Action& chosen);
void add_info(CLI::App& app, Action& chosen);

}  // namespace gpureg::cli
