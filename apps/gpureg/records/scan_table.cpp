// SPDX-License-Identifier: BSD-3-Clause
#include "records/scan_table.hpp"

#include <filesystem>

#include "gpureg/files.hpp"

namespace gpureg::cli {
namespace {

/// As RFC 4180 has it.
std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

}  // namespace

void write_scan_table(const std::string& path, const std::vector<io::ScanFile>& scans) {
  std::string text = "number,name,file\n";
  for (const io::ScanFile& scan : scans)
    text +=
        std::to_string(scan.number) + "," + csv_cell(scan.name) + "," + csv_cell(scan.path) + "\n";
  files::write_atomically(path, text);
}

std::string scan_table_of(const std::string& file) {
  const std::filesystem::path path(file);
  return (path.parent_path() / (path.stem().string() + "_scans.csv")).string();
}

}  // namespace gpureg::cli
