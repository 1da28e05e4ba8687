// SPDX-License-Identifier: BSD-3-Clause
#include "output_path.hpp"

#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

#include "gpureg/error.hpp"

namespace gpureg::cli {

void check_output(const std::string& path) {
  if (path.empty()) return;
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) throw IoError("cannot write " + path + ": it is a folder");
  const fs::path parent = fs::path(path).parent_path();
  const fs::path folder = parent.empty() ? fs::path(".") : parent;
  if (!fs::is_directory(folder, ignored))
    throw IoError("cannot write " + path + ": there is no folder " + folder.string());
  // A device or a pipe is written in place, and needs nothing from its folder.
  const bool in_place = fs::exists(path, ignored) && !fs::is_regular_file(path, ignored);
  if (::access(in_place ? path.c_str() : folder.c_str(), W_OK) != 0)
    throw IoError("cannot write " + path + ": " + std::generic_category().message(errno));
}

}  // namespace gpureg::cli
