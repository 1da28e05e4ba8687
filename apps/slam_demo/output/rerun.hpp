// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace slam_demo {

/// Throws Error unless python3 and its package rerun-sdk are there.
void require_rerun();

/// Opens the viewer of rerun.io, which follows the progress.jsonl of a folder. Returns at once;
/// Ctrl-C does not reach it. Throws Error.
void start_view(const std::string& results);

/// Writes progress.jsonl and the results of a folder as a recording for the viewer of rerun.io.
/// Throws Error.
void write_rerun(const std::string& results, const std::string& path);

}  // namespace slam_demo
