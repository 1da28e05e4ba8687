// SPDX-License-Identifier: BSD-3-Clause
#include "io/scans/parts.hpp"

#include <filesystem>
#include <map>
#include <mutex>
#include <tuple>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "io/extension.hpp"

namespace gpureg::io::scans {
namespace {

namespace fs = std::filesystem;

/// A file as it was when its scans were counted.
using Version = std::tuple<std::string, fs::file_time_type, std::uintmax_t>;

std::size_t count(const std::string& path) try {
  return count_scans(path);
} catch (const IoError&) {
  return 1;
}

}  // namespace

std::size_t parts_of(const std::string& path) {
  const std::string extension = extension_of(path);
  if (extension != ".ptx" && extension != ".e57") return 1;
  // A run lists its scans several times, and the scans of a PTX are only known at its end.
  static std::mutex mutex;
  static std::map<Version, std::size_t> counts;
  std::error_code unknown, ignored;
  const Version version(path, fs::last_write_time(path, unknown), fs::file_size(path, ignored));
  if (unknown || ignored) return count(path);
  const std::lock_guard lock(mutex);
  const auto [found, is_new] = counts.insert({version, 0});
  if (is_new) found->second = count(path);
  return found->second;
}

}  // namespace gpureg::io::scans
