// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iterator>
#include <limits>
#include <optional>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"

namespace gpureg::io {
namespace {

constexpr std::string_view kPrefix = "cloud_bin_";
constexpr std::string_view kExtensions[] = {".ply", ".pcd", ".bin", ".stl", ".obj"};

// Number of a name like cloud_bin_12.ply; none for other names.
std::optional<int> fragment_number(std::string_view name) {
  if (name.size() < kPrefix.size() + 5 || name.substr(0, kPrefix.size()) != kPrefix) return {};
  const std::string_view extension = name.substr(name.size() - 4);
  if (std::find(std::begin(kExtensions), std::end(kExtensions), extension) == std::end(kExtensions))
    return {};
  const std::string_view digits = name.substr(kPrefix.size(), name.size() - kPrefix.size() - 4);
  int number = 0;
  const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc() || stop != digits.data() + digits.size() || digits[0] == '-') return {};
  return number;
}

}  // namespace

std::vector<std::pair<int, std::string>> list_fragments(const std::string& folder) {
  std::error_code error;
  std::filesystem::directory_iterator entries(folder, error);
  if (error) throw IoError("cannot list the folder " + folder + ": " + error.message());
  std::map<int, std::string> fragments;
  for (; entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    const auto number = fragment_number(entries->path().filename().string());
    std::error_code unreadable;  // a dangling link is not a fragment
    if (number && std::filesystem::is_regular_file(entries->path(), unreadable)) {
      // The files of results have the number of fragments, an int, beside their numbers.
      if (*number == std::numeric_limits<int>::max())
        throw IoError("the number of the fragment " + entries->path().string() +
                      " is too large, expected at most 2147483646");
      const auto [first, is_new] = fragments.emplace(*number, entries->path().string());
      if (!is_new)
        throw IoError("fragment " + std::to_string(*number) + " is twice in the folder: " +
                      first->second + " and " + entries->path().string());
    }
  }
  if (error) throw IoError("cannot list the folder " + folder + ": " + error.message());
  if (fragments.empty())
    throw IoError("no fragments cloud_bin_<i>.ply, .pcd, .bin, .stl or .obj in the folder " +
                  folder);
  return {fragments.begin(), fragments.end()};
}

}  // namespace gpureg::io
