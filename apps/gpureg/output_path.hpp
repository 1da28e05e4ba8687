// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace gpureg::cli {

/// Throws IoError where path cannot become a file: found out before the work, not after hours of
/// it. Empty paths are fine.
void check_output(const std::string& path);

}  // namespace gpureg::cli
