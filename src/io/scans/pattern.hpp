// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace gpureg::io::scans {

/// Whether nothing has this path, and it has a * ? or [.
bool is_pattern(const std::string& path);

/// What comes before the first of these.
std::string fixed_part(const std::string& pattern);

/// Files and folders that match a pattern of the shell; ** stands for folders however deep, of
/// which the clouds count.
std::vector<std::string> matches(const std::string& pattern);

}  // namespace gpureg::io::scans
