// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gpureg/result.hpp"
#include "inputs/scan_input.hpp"

namespace gpureg::cli {

/// What `gpureg reconstruct` wrote, as far as other verbs read it: all from reconstruction.json, so
/// that nothing of another run gets in.
struct SavedMap {
  std::string file;  ///< its reconstruction.json
  ScanInput scans;
  std::vector<std::vector<int>> islands;     ///< numbers of fragments, the largest island first
  std::map<int, UnalignedIsometry3d> poses;  ///< of fragments, in the frames of their islands
  std::map<std::string, int> numbers;        ///< of scans, by their names

  /// The number that a scan had; others may have come and gone since. None: it is not in the map.
  std::optional<int> number_of(const io::ScanFile& scan) const;
};

/// For messages about a folder without one.
inline constexpr const char* kWrittenLast =
    ", which `gpureg reconstruct` writes when all else is there";

/// The reconstruction.json that a path stands for: of a folder, or the file itself. Empty: none.
std::string saved_map_file(const std::string& path);

/// @param file reconstruction.json
/// @throws IoError naming the file and what is wrong.
SavedMap read_saved_map(const std::string& file);

}  // namespace gpureg::cli
