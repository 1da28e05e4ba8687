// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace gpureg::fuzz {

/// One input of the library or of the command. run() returns for valid inputs and for those that
/// are refused as documented; anything else throws or crashes.
struct Target {
  const char* name;
  void (*run)(std::string_view bytes);
};

/// Point clouds, Redwood's files, cameras.txt, pairs, trajectories, pose graphs, saved states.
std::vector<Target> file_targets();
/// Meshes.
std::vector<Target> mesh_targets();
/// What the command reads: JSON documents, results, journals, poses.
std::vector<Target> command_targets();
/// The functions of the library, with options and clouds made of bytes.
std::vector<Target> api_targets();

/// Saved maps, places and changes in maps, audits.
std::vector<Target> map_targets();

std::vector<Target> all_targets();

/// Throws std::logic_error: the input broke a promise.
[[noreturn]] void broken(const std::string& promise);

}  // namespace gpureg::fuzz
