// SPDX-License-Identifier: BSD-3-Clause
#include "files/text_file.hpp"
#include "gpureg/io.hpp"

namespace gpureg::io {

std::vector<std::pair<int, int>> read_pairs(const std::string& path) {
  std::vector<std::pair<int, int>> pairs;
  files::TextFile file(path, '#');
  while (file.next()) {
    if (file.fields().size() != 2)
      file.fail("a pair has " + std::to_string(file.fields().size()) + " fields, expected 2: i j");
    const int i = file.index(0, "i"), j = file.index(1, "j");
    if (i == j) file.fail("fragment " + std::to_string(i) + " is paired with itself");
    pairs.emplace_back(i, j);
  }
  return pairs;
}

}  // namespace gpureg::io
