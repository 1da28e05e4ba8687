// SPDX-License-Identifier: BSD-3-Clause
#include "options/output_path.hpp"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <filesystem>
#include <iterator>
#include <system_error>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "inputs/saved_map.hpp"

namespace gpureg::cli {
namespace {

namespace fs = std::filesystem;

// Where nothing is yet, the name decides.
bool same_file(const std::string& a, const std::string& b) {
  if (a.empty() || b.empty()) return false;
  std::error_code error;
  if (fs::exists(a, error) && !fs::is_regular_file(a, error)) return false;
  const bool same = fs::equivalent(a, b, error);
  if (!error) return same;
  std::error_code other_error;
  const fs::path x = fs::weakly_canonical(a, error), y = fs::weakly_canonical(b, other_error);
  return !error && !other_error && x == y;
}

void refuse_same(const NamedPath& output, const NamedPath& other) {
  if (!same_file(output.path, other.path)) return;
  const std::string& a = output.path;
  const std::string& b = other.path;
  throw InvalidArgument(output.name + " and " + other.name + " must name different files, not " +
                        a + (a == b ? " twice" : " and " + b));
}

void check_input(const NamedPath& input) {
  // Who lists the files of a pattern says what is wrong with it.
  if (ScanInput::is_pattern(input.path)) return;
  if (input.path.empty() || ::access(io::scan_path(input.path).file.c_str(), R_OK) == 0) return;
  throw IoError(input.name + ": cannot read " + input.path + ": " +
                std::generic_category().message(errno));
}

constexpr const char* kReconstruction = "reconstruction.json";
constexpr const char* kTruth[] = {"cameras.txt", "gt.log", "gt.info", "gt_all.log", "gt_all.info"};
constexpr const char* kMap[] = {"poses.txt",     "trajectory.txt", "edges.log", "graph.g2o",
                                "map.ply",       "map.html",       "scans.csv", "pairs.json",
                                "pairs.journal", kReconstruction};

/// "poses.txt" of "poses_1.txt", the file of a further island.
std::string of_first_island(const std::string& name) {
  const std::size_t dot = std::min(name.rfind('.'), name.size());
  std::size_t at = dot;
  while (at > 0 && std::isdigit(static_cast<unsigned char>(name[at - 1]))) --at;
  if (at == dot || at == 0 || name[at - 1] != '_') return name;
  return name.substr(0, at - 1) + name.substr(dot);
}

/// Whether a file of a map or a cloud of a scene has this name.
bool belongs(const std::string& name) {
  return std::find(std::begin(kMap), std::end(kMap), of_first_island(name)) != std::end(kMap) ||
         name.rfind("cloud_bin_", 0) == 0;
}

void add_folder(const std::string& name, const fs::path& folder, std::vector<NamedPath>& files) {
  // Nor may these come to be: the next run would read them.
  for (const char* file : kTruth) files.push_back({name, (folder / file).string()});
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (belongs(entry->path().filename().string())) files.push_back({name, entry->path().string()});
}

/// The files that an input stands for.
std::vector<NamedPath> files_of(const NamedPath& input) {
  const fs::path path(io::scan_path(input.path).file);
  std::vector<NamedPath> files = {{input.name, path.string()}};
  std::error_code error;
  const bool is_folder = fs::is_directory(path, error);
  if (io::names_scans(input.path)) try {
      for (const io::ScanFile& scan : io::list_scans(input.path))
        files.push_back({input.name, scan.path});
    } catch (const Error&) {
    }
  if (is_folder) add_folder(input.name, path, files);
  const fs::path reconstruction = is_folder ? path / kReconstruction : path;
  if (reconstruction.filename() != kReconstruction || !fs::exists(reconstruction, error))
    return files;
  if (!is_folder)
    add_folder(input.name, path.parent_path().empty() ? "." : path.parent_path(), files);
  try {
    add_folder(input.name, read_saved_map(reconstruction.string()).scans.folder(), files);
  } catch (const Error&) {  // whoever reads it says what is wrong with it
  }
  return files;
}

}  // namespace

void check_output(const std::string& path) {
  if (path.empty()) return;
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

void check_outputs(const std::vector<NamedPath>& outputs, const std::vector<NamedPath>& inputs) {
  for (const NamedPath& input : inputs) check_input(input);
  for (const NamedPath& output : outputs) check_output(output.path);
  for (std::size_t k = 0; k < outputs.size(); ++k)
    for (std::size_t other = 0; other < k; ++other) refuse_same(outputs[k], outputs[other]);
  for (const NamedPath& input : inputs)
    for (const NamedPath& file : files_of(input))
      for (const NamedPath& output : outputs) refuse_same(output, file);
}

}  // namespace gpureg::cli
