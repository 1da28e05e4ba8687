// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gpureg/io.hpp"

namespace gpureg::cli {

/// Writes a table (CSV: number, name, file) of what the numbers in other files mean. @throws
/// IoError.
void write_scan_table(const std::string& path, const std::vector<io::ScanFile>& scans);

/// Path of the table beside a file whose format has numbers alone: r_scans.csv of r.log.
std::string scan_table_of(const std::string& file);

}  // namespace gpureg::cli
