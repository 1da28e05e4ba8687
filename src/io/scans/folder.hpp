// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace gpureg::io::scans {

/// A file, and its name for people: below the folder that was searched.
struct Found {
  std::string path, name;
};

/// What a folder holds, hidden files aside; each list in natural order.
struct Contents {
  std::vector<Found> clouds;
  std::vector<std::string> others;   ///< names of files that are no clouds
  std::vector<std::string> broken;   ///< names of links to nothing that look like clouds
  std::vector<std::string> folders;  ///< names of subfolders that were not entered
  std::vector<std::string> maps;     ///< outputs of `gpureg reconstruct` that were not entered
};

/// @throws IoError where the folder cannot be listed.
Contents contents_of(const std::string& folder, bool recursive);

/// "a.ply, b.ply and 7 more".
std::string listed(const std::vector<std::string>& names);

/// Leaves out texts beside a cloud of the same name, which describe it.
/// @throws IoError where two clouds have one name with two extensions: one scan in two formats
/// would
///   be two scans in one place.
void drop_doubles(const std::string& where, Contents& contents);

/// Why a folder gives no scan, and what to do.
std::string explain_no_cloud(const std::string& folder, const Contents& contents);

/// The formats that are read, for messages.
extern const char* const kFormats;

}  // namespace gpureg::io::scans
