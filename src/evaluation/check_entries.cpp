// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <utility>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"

namespace gpureg::evaluation {
namespace {

template <typename Entry>
void check(const std::string& path, const std::vector<Entry>& entries) {
  std::map<std::pair<int, int>, int> lines;
  for (const Entry& entry : entries) {
    const auto fail = [&](const std::string& reason) {
      throw IoError(path + ":" + std::to_string(entry.line) + ": pair " + std::to_string(entry.i) +
                    " " + std::to_string(entry.j) + " " + reason);
    };
    const int count = entries.front().count;
    if (entry.count != count)
      fail("says that there are " + std::to_string(entry.count) +
           " fragments, the first block says " + std::to_string(count));
    if (entry.i >= count || entry.j >= count)
      fail("is out of range, the file says that there are " + std::to_string(count) +
           " fragments, from 0");
    if (entry.i == entry.j) fail("is a fragment and itself");
    const auto [first, is_new] = lines.insert({{entry.i, entry.j}, entry.line});
    if (!is_new) fail("stands twice, first in line " + std::to_string(first->second));
  }
}

}  // namespace

void check_entries(const std::string& path, const std::vector<LogEntry>& entries) {
  check(path, entries);
}

void check_entries(const std::string& path, const std::vector<InformationEntry>& entries) {
  check(path, entries);
}

}  // namespace gpureg::evaluation
