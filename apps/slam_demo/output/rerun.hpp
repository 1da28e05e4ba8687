// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace slam_demo {

/// Throws Error unless python3 and its package rerun-sdk are there.
void require_rerun();

/// Writes the files that write_results() left in a folder as a recording for the viewer of
/// rerun.io. Throws Error.
void write_rerun(const std::string& results, const std::string& path);

}  // namespace slam_demo
