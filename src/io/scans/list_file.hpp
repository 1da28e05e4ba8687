// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace gpureg::io::scans {

/// A line of a list of clouds.
struct Listed {
  std::string path;  ///< see scan_path()
  std::string name;  ///< empty: none was given
  std::size_t line = 0;
};

/// Reads a list: a path a line, relative to the folder of the list, and perhaps a name after it.
/// Blank lines, and lines that begin with a #, are skipped.
/// @throws IoError naming file and line: no such file, a folder, no text.
std::vector<Listed> read_list(const std::string& path);

}  // namespace gpureg::io::scans
