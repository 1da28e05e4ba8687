// SPDX-License-Identifier: BSD-3-Clause
#include "files/text_file.hpp"
#include "gpureg/io.hpp"
#include "io/scans/word.hpp"

namespace gpureg::io {
namespace {

std::pair<int, int> numbers(const files::TextFile& file) {
  if (file.fields().size() != 2)
    file.fail("a pair has " + std::to_string(file.fields().size()) + " fields, expected 2: i j");
  return {file.index(0, "i"), file.index(1, "j")};
}

[[noreturn]] void fail(const files::TextFile& file, std::string_view word) {
  file.fail(scans::is_digits(word) ? "there is no fragment " + std::string(word)
                                   : "there is no scan named " + files::in_quotes(word));
}

/// The only place where a line falls into the words of two scans: names may have blanks.
std::pair<int, int> pair_of(const files::TextFile& file, const std::vector<ScanFile>& scans) {
  const std::size_t count = file.fields().size();
  std::vector<std::pair<int, int>> found;
  for (std::size_t at = 1; at < count; ++at) {
    const auto i = find_scan(scans, scans::words(file, 0, at)),
               j = find_scan(scans, scans::words(file, at, count));
    if (i && j) found.emplace_back(scans[*i].number, scans[*j].number);
  }
  if (found.size() == 1) return found.front();
  if (found.size() > 1)
    file.fail("more than one pair can be meant; give names with their extensions, or numbers");
  if (count == 2) {
    const bool first = !find_scan(scans, file.fields()[0]);
    fail(file, file.fields()[first ? 0 : 1]);
  }
  if (count < 2) numbers(file);
  file.fail(files::in_quotes(scans::words(file, 0, count)) +
            " names no two scans, expected two names or numbers");
}

}  // namespace

std::vector<std::pair<int, int>> read_pairs(const std::string& path,
                                            const std::vector<ScanFile>& scans) {
  std::vector<std::pair<int, int>> pairs;
  files::TextFile file(path, '#');
  while (file.next()) {
    const auto [i, j] = scans.empty() ? numbers(file) : pair_of(file, scans);
    if (i == j) file.fail("fragment " + std::to_string(i) + " is paired with itself");
    pairs.emplace_back(i, j);
  }
  return pairs;
}

}  // namespace gpureg::io
