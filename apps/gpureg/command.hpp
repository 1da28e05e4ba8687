// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "command_line.hpp"
#include "exit_status.hpp"

namespace gpureg::cli {

/// Each adds its verb.
void add_register(CommandLine& line);
void add_batch(CommandLine& line);
void add_consistency(CommandLine& line);
void add_reconstruct(CommandLine& line);
void add_locate(CommandLine& line);
void add_change(CommandLine& line);
void add_find(CommandLine& line);
void add_evaluate(CommandLine& line);
void add_evaluate_trajectory(CommandLine& line);
void add_evaluate_surface(CommandLine& line);
void add_report(CommandLine& line);
void add_view(CommandLine& line);
void add_calibrate(CommandLine& line);
void add_info(CommandLine& line);

}  // namespace gpureg::cli
