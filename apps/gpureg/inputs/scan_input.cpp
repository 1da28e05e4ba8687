// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/scan_input.hpp"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <set>
#include <sstream>

#include "text.hpp"

namespace gpureg::cli {
namespace {

namespace fs = std::filesystem;

bool is_numbered(const io::ScanFile& scan) {
  return scan.name.rfind("cloud_bin_" + std::to_string(scan.number) + ".", 0) == 0;
}

}  // namespace

bool ScanInput::is_pattern(const std::string& path) {
  std::error_code ignored;
  return io::names_scans(path) && !fs::exists(path, ignored);
}

std::vector<io::ScanFile> ScanInput::list(bool quiet) const {
  std::vector<std::string> notes;
  std::vector<io::ScanFile> scans = io::list_scans(path, recursive, &notes);
  static std::set<std::string> said;  // a run lists its scans more than once
  for (const std::string& note : notes)
    if (!quiet && said.insert(note).second) std::cerr << "gpureg: note: " << note << std::endl;
  return scans;
}

bool ScanInput::exists() const {
  std::error_code ignored;
  return fs::exists(path, ignored) || (is_pattern(path) && fs::exists(folder(), ignored));
}

ScanInput ScanInput::beside(const std::string& other) const {
  const fs::path tail = is_pattern(path)
                            ? fs::path(path).lexically_relative(fs::path(folder()).parent_path())
                            : fs::path(base_name(path));
  return {(fs::path(other) / tail).string(), recursive};
}

std::string label(const io::ScanFile& scan) {
  return is_numbered(scan) ? std::to_string(scan.number) : scan.name;
}

std::string titled(const io::ScanFile& scan) {
  return is_numbered(scan) ? "fragment " + std::to_string(scan.number) : scan.name;
}

bool are_numbered(const std::vector<io::ScanFile>& scans) {
  return std::all_of(scans.begin(), scans.end(), is_numbered);
}

std::string labels(const std::vector<io::ScanFile>& scans) {
  std::ostringstream out;
  if (!are_numbered(scans)) {
    constexpr std::size_t kShown = 5;
    const std::size_t shown = scans.size() > kShown + 1 ? kShown : scans.size();
    for (std::size_t k = 0; k < shown; ++k) out << (k > 0 ? ", " : "") << label(scans[k]);
    if (shown < scans.size()) out << " and " << scans.size() - shown << " more";
    return out.str();
  }
  for (std::size_t k = 0; k < scans.size();) {
    std::size_t last = k;
    while (last + 1 < scans.size() && scans[last + 1].number == scans[last].number + 1) ++last;
    out << (k > 0 ? ", " : "") << scans[k].number;
    if (last > k) out << (last == k + 1 ? ", " : "-") << scans[last].number;
    k = last + 1;
  }
  return out.str();
}

}  // namespace gpureg::cli
