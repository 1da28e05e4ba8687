// SPDX-License-Identifier: BSD-3-Clause
#include "io/scans/folder.hpp"
#include "io/extension.hpp"

#include <algorithm>
#include <filesystem>
#include <set>
#include <system_error>

#include "gpureg/error.hpp"
#include "io/scans/names.hpp"

namespace gpureg::io::scans {
namespace {

namespace fs = std::filesystem;

/// Walks a folder, and on request all below it, each once also where links go round.
class Walk {
 public:
  Walk(bool recursive, Contents& out) : recursive_(recursive), out_(out) {}

  void enter(const fs::path& folder, const std::string& prefix) {
    std::error_code error;
    const fs::path where = fs::canonical(folder, error);
    if (!error && !seen_.insert(where.string()).second) return;
    fs::directory_iterator entries(folder, error);
    for (; !error && entries != fs::directory_iterator(); entries.increment(error))
      take(entries->path(), prefix);
    if (error) throw IoError("cannot list the folder " + folder.string() + ": " + error.message());
  }

 private:
  void take(const fs::path& path, const std::string& prefix) {
    const std::string file = path.filename().string();
    if (file.front() == '.') return;
    const std::string name = prefix + file;
    std::error_code ignored;
    const fs::file_status status = fs::status(path, ignored);
    if (fs::is_directory(status)) {
      if (!recursive_)
        out_.folders.push_back(name);
      else if (fs::exists(path / "reconstruction.json", ignored))
        out_.maps.push_back(name);
      else
        enter(path, name + "/");
    } else if (fs::is_regular_file(status)) {
      if (is_cloud_file(path.string()))
        out_.clouds.push_back({path.string(), name});
      else
        out_.others.push_back(name);
    } else if (is_cloud_extension(extension_of(file))) {
      out_.broken.push_back(name);
    }
  }

  bool recursive_;
  Contents& out_;
  std::set<std::string> seen_;
};

}  // namespace

Contents contents_of(const std::string& folder, bool recursive) {
  Contents out;
  Walk(recursive, out).enter(folder, "");
  std::sort(out.clouds.begin(), out.clouds.end(),
            [](const Found& a, const Found& b) { return natural_less(a.name, b.name); });
  for (auto* names : {&out.others, &out.broken, &out.folders, &out.maps})
    std::sort(names->begin(), names->end(), natural_less);
  return out;
}

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 3;
  const std::size_t shown = names.size() <= kShown + 1 ? names.size() : kShown;
  std::string text;
  for (std::size_t k = 0; k < shown; ++k) text += (k > 0 ? ", " : "") + printable(names[k]);
  if (shown < names.size()) text += " and " + std::to_string(names.size() - shown) + " more";
  return text;
}

}  // namespace gpureg::io::scans
