// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>

#include "files/text_file.hpp"
#include "gpureg/io.hpp"
#include "io/clouds/e57.hpp"
#include "io/clouds/ptx.hpp"
#include "io/limits.hpp"

namespace gpureg::io {

ScanPath scan_path(const std::string& path) {
  const std::size_t mark = path.rfind('#');
  std::size_t part = 0;
  std::error_code ignored;
  if (mark == path.npos || !parse_count(std::string_view(path).substr(mark + 1), part) ||
      part == 0 || std::filesystem::exists(path, ignored))
    return {path, 0};
  return {path.substr(0, mark), part};
}

std::vector<StoredScan> scans_in(const std::string& path) {
  const std::string start = files::read_start(path, kMostHeaderBytes);
  if (looks_like_e57(start)) return index_e57(path);
  if (!looks_like_ptx(start)) return {};
  const std::string bytes = files::read_file(path, kMostDataBytes);
  Source source(path, bytes);
  return index_ptx(source);
}

std::size_t count_scans(const std::string& path) {
  const std::size_t count = scans_in(path).size();
  return std::max<std::size_t>(count, 1);
}

}  // namespace gpureg::io
