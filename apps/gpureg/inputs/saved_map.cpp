// SPDX-License-Identifier: BSD-3-Clause
#include "inputs/saved_map.hpp"

#include <filesystem>

#include "gpureg/error.hpp"
#include "json/json.hpp"
#include "json/json_fields.hpp"
#include "json/json_file.hpp"

namespace gpureg::cli {
namespace {

namespace fs = std::filesystem;

const Json& list_member(const Json& object, const char* name) {
  const Json& list = member(object, name);
  if (!list.is_array()) throw InvalidArgument(std::string("\"") + name + "\" is no list");
  return list;
}

void add_scan(const Json& scan, SavedMap& map) {
  if (const auto name = scan.find("name"); name != scan.end() && name->is_string())
    map.numbers[name->get<std::string>()] = fragment_member(scan, "id");
  if (member(scan, "island").is_null()) return;  // it is left out
  const int number = fragment_member(scan, "id");
  const auto island = static_cast<std::size_t>(fragment_member(scan, "island"));
  if (island >= map.islands.size())
    throw InvalidArgument("fragment " + std::to_string(number) + " is of island " +
                          std::to_string(island) + " of " + std::to_string(map.islands.size()));
  UnalignedIsometry3d pose;
  pose.matrix() = rigid_motion(member(scan, "island_from_scan"), "island_from_scan");
  if (!map.poses.emplace(number, pose).second)
    throw InvalidArgument("fragment " + std::to_string(number) + " stands twice");
  map.islands[island].push_back(number);
}

}  // namespace

std::optional<int> SavedMap::number_of(const io::ScanFile& scan) const {
  const auto found = numbers.find(scan.name);
  const int number = found != numbers.end() ? found->second : scan.number;
  if ((found == numbers.end() && !numbers.empty()) || poses.count(number) == 0) return {};
  return number;
}

std::string saved_map_file(const std::string& path) {
  std::error_code ignored;
  const fs::path name = "reconstruction.json";
  if (fs::is_directory(path, ignored)) {
    const fs::path file = fs::path(path) / name;
    return fs::exists(file, ignored) ? file.string() : std::string();
  }
  return fs::path(path).extension() == ".json" ? path : std::string();
}

SavedMap read_saved_map(const std::string& file) {
  SavedMap map;
  map.file = file;
  DocumentFile document(file);
  const Json json = document.read();
  try {
    map.scans.path = text_member(json, "folder");
    map.scans.recursive = json.value("recursive", false);
    map.islands.resize(list_member(json, "islands").size());
    if (map.islands.empty()) throw InvalidArgument("no scan was placed");
    for (const Json& scan : list_member(json, "scans")) add_scan(scan, map);
  } catch (const InvalidArgument& error) {
    throw IoError(file + ": " + error.what());
  }
  // The folder was named from where `reconstruct` ran.
  if (!map.scans.exists()) {
    const ScanInput beside =
        map.scans.beside(fs::absolute(file).parent_path().parent_path().string());
    if (beside.exists()) map.scans = beside;
  }
  return map;
}

}  // namespace gpureg::cli
