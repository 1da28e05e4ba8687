// SPDX-License-Identifier: BSD-3-Clause
#include "io/scans/pattern.hpp"

#include <fnmatch.h>
#include <glob.h>

#include <filesystem>

#include "io/scans/folder.hpp"

namespace gpureg::io::scans {

namespace fs = std::filesystem;

constexpr const char* kWild = "*?[";

bool is_pattern(const std::string& path) {
  std::error_code ignored;
  return path.find_first_of(kWild) != std::string::npos && !fs::exists(path, ignored);
}

std::string fixed_part(const std::string& pattern) {
  return pattern.substr(0, pattern.find_first_of(kWild));
}

std::vector<std::string> matches(const std::string& pattern) {
  std::vector<std::string> out;
  const std::size_t deep = pattern.find("**");
  if (deep != std::string::npos) {
    const std::string folder = pattern.substr(0, deep);
    const Contents contents = contents_of(folder.empty() ? "." : folder, true);
    std::string name = pattern.substr(deep + 2);
    name = name.rfind('/', 0) == 0 ? name.substr(1) : "*" + name;
    for (const Found& cloud : contents.clouds) {
      const std::string file = fs::path(cloud.name).filename().string();
      if (::fnmatch(name.c_str(), file.c_str(), 0) == 0 ||
          ::fnmatch(("*/" + name).c_str(), cloud.name.c_str(), 0) == 0)
        out.push_back(cloud.path);
    }
    return out;
  }
  glob_t found{};
  if (::glob(pattern.c_str(), GLOB_TILDE | GLOB_BRACE, nullptr, &found) == 0)
    for (std::size_t k = 0; k < found.gl_pathc; ++k) out.emplace_back(found.gl_pathv[k]);
  ::globfree(&found);
  return out;
}

}  // namespace gpureg::io::scans
