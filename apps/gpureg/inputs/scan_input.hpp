// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "gpureg/io.hpp"

namespace gpureg::cli {

/// Scans as the command line names them: a folder, a pattern in quotes, a list, a file with several
/// scans. See io::list_scans().
struct ScanInput {
  std::string path;
  bool recursive = false;

  /// The scans; unless quiet, says on stderr what was skipped. @throws IoError.
  std::vector<io::ScanFile> list(bool quiet) const;

  /// Where files beside the scans are looked for: cameras.txt, poses.txt.
  std::string folder() const { return io::folder_of_scans(path); }

  /// Whether something is there that may hold scans.
  bool exists() const;

  /// The same in another folder.
  ScanInput beside(const std::string& other) const;

  /// Whether a path is a pattern, "scans/*.ply".
  static bool is_pattern(const std::string& path);
};

/// Help of the positional argument, and of --recursive.
inline constexpr const char* kScansHelp =
    "Folder of scans (cloud_bin_<i>, or any clouds and meshes in natural order), a pattern in "
    "quotes "
    "('scans/*.ply'), a text file with one path a line, or a file with several scans; beside them "
    "perhaps cameras.txt";
inline constexpr const char* kPairsHelp =
    "all, or a file with one pair a line: numbers or names of two scans";
inline constexpr const char* kRecursiveHelp = "Also the clouds in all subfolders";

/// What people call a scan: 12 for cloud_bin_12, else its name.
std::string label(const io::ScanFile& scan);

/// "fragment 12", or the name.
std::string titled(const io::ScanFile& scan);

/// What people call these scans: "3-7, 9" of cloud_bin_<i>, else names, the first of many.
std::string labels(const std::vector<io::ScanFile>& scans);

/// Whether numbers tell people which scan is meant: cloud_bin_<i>.
bool are_numbered(const std::vector<io::ScanFile>& scans);

}  // namespace gpureg::cli
