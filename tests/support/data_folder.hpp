// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace gpureg::test {

/// Folder of that name under GPUREG_DATA_DIR; empty where the variable is not set or the folder is
/// missing.
inline std::string data_folder(const std::string& name) {
  const char* root = std::getenv("GPUREG_DATA_DIR");
  if (root == nullptr || *root == '\0') return {};
  const auto folder = std::filesystem::path(root) / name;
  return std::filesystem::exists(folder) ? folder.string() : std::string();
}

}  // namespace gpureg::test

/// Declares `variable` as a folder of the real data sets, or skips the test where they are not at
/// hand.
#define GPUREG_DATA_FOLDER_OR_SKIP(variable, name)                \
  const std::string variable = ::gpureg::test::data_folder(name); \
  if (variable.empty())                                           \
  GTEST_SKIP() << "GPUREG_DATA_DIR does not point at a folder that holds " << (name)
