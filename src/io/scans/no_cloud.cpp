// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <map>

#include "gpureg/error.hpp"
#include "io/clouds/foreign.hpp"
#include "io/scans/folder.hpp"

namespace gpureg::io::scans {
namespace {

namespace fs = std::filesystem;

/// Names of the clouds in the folders below; as far as they can be listed.
std::vector<std::string> clouds_below(const std::string& folder) {
  std::vector<std::string> names;
  try {
    for (const Found& cloud : contents_of(folder, true).clouds) names.push_back(cloud.name);
  } catch (const IoError&) {
  }
  return names;
}

/// The subfolder that has all clouds, or "one of them".
std::string one_folder(const std::string& folder, const std::vector<std::string>& names) {
  const std::string first = names.front().substr(0, names.front().rfind('/'));
  const bool all = std::all_of(names.begin(), names.end(), [&](const std::string& name) {
    return name.substr(0, name.rfind('/')) == first;
  });
  return all ? (fs::path(folder) / first).string() : "one of them";
}

/// Names of files that are no clouds, then those of the subfolders.
std::vector<std::string> others_of(const std::string& folder, const Contents& contents) {
  std::vector<std::string> names = contents.others;
  for (const std::string& inner : contents.folders)
    for (const std::string& name : contents_of((fs::path(folder) / inner).string(), false).others)
      names.push_back(inner + "/" + name);
  return names;
}

/// What most of these files are that are known, and their names.
std::pair<std::string, std::vector<std::string>> most_known(const std::vector<std::string>& names) {
  std::map<std::string, std::vector<std::string>> of;
  for (const std::string& name : names)
    if (const std::string format = foreign_format(name, ""); !format.empty())
      of[format].push_back(name);
  if (of.empty()) return {};
  return *std::max_element(of.begin(), of.end(), [](const auto& a, const auto& b) {
    return a.second.size() < b.second.size();
  });
}

std::string counted(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " file" : " files");
}

}  // namespace

const char* const kFormats =
    "PLY, PCD, KITTI or nuScenes .bin, LAS, LAZ, E57, PTX, PTS, XYZ, ASC, CSV or TXT with x y z, "
    "STL, OBJ, OFF";

std::string explain_no_cloud(const std::string& folder, const Contents& contents) {
  const std::string where = "the folder " + folder;
  if (const std::vector<std::string> clouds = clouds_below(folder); !clouds.empty())
    return where + " has no clouds itself, but " + std::to_string(clouds.size()) +
           " in subfolders (" + listed(clouds) + "): give " + one_folder(folder, clouds) +
           ", or search all with --recursive (Python: recursive=True)";
  if (!contents.broken.empty())
    return where + " has only links to files that are not there: " + listed(contents.broken);
  const std::vector<std::string> names = others_of(folder, contents);
  if (names.empty())
    return where + (contents.folders.empty() ? " is empty" : " holds no files") +
           ", expected scans: " + kFormats;
  if (const auto [format, of_format] = most_known(names); !of_format.empty())
    return where + " has no clouds, but " + counted(of_format.size()) + " (" + listed(of_format) +
           "), " + (of_format.size() == 1 ? "" : "each ") + format;
  return where + " has no clouds, but " + counted(names.size()) + " that " +
         (names.size() == 1 ? "is" : "are") + " none (" + listed(names) + "); expected " + kFormats;
}

}  // namespace gpureg::io::scans
