// SPDX-License-Identifier: BSD-3-Clause
#include "options/output_path.hpp"

#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"

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

std::vector<NamedPath> truth_files(const std::string& name, const std::string& folder) {
  std::vector<NamedPath> files;
  for (const char* file : {"gt.log", "gt.info", "gt_all.log", "gt_all.info"})
    if (!folder.empty()) files.push_back({name, (fs::path(folder) / file).string()});
  return files;
}

std::vector<NamedPath> scene_files(const std::string& name, const std::string& folder) {
  if (folder.empty()) return {};
  std::vector<NamedPath> files = {{name, (fs::path(folder) / "cameras.txt").string()}};
  for (const auto& [number, file] : io::list_fragments(folder)) files.push_back({name, file});
  return files;
}

void check_outputs(const std::vector<NamedPath>& outputs, const std::vector<NamedPath>& inputs) {
  for (const NamedPath& output : outputs) check_output(output.path);
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    for (const NamedPath& input : inputs) refuse_same(outputs[k], input);
    for (std::size_t other = 0; other < k; ++other) refuse_same(outputs[k], outputs[other]);
  }
}

}  // namespace gpureg::cli
