// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>

#include "gpureg/io.hpp"
#include "io/extension.hpp"
#include "io/scans/names.hpp"
#include "io/scans/pattern.hpp"

namespace gpureg::io {

namespace fs = std::filesystem;

bool names_scans(const std::string& path) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (!fs::is_regular_file(status)) return fs::is_directory(status) || scans::is_pattern(path);
  const std::string extension = extension_of(path);
  return (scans::is_text_extension(extension) || extension == ".lst" || extension == ".list") &&
         !scans::is_cloud_file(path);
}

std::string folder_of_scans(const std::string& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return path;
  const fs::path parent =
      fs::path(scans::is_pattern(path) ? scans::fixed_part(path) : path).parent_path();
  return parent.empty() ? "." : parent.string();
}

}  // namespace gpureg::io
