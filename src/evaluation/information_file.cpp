// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/block_file.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/files.hpp"

namespace gpureg::evaluation {

std::vector<InformationEntry> read_information(const std::string& path) {
  std::vector<InformationEntry> entries;
  files::read_blocks<6>(path, [&](const files::TextFile&, int i, int j, int n,
                                  const Eigen::Matrix<double, 6, 6>& information,
                                  int line) { entries.push_back({i, j, n, information, line}); });
  return entries;
}

void write_information(const std::string& path, const std::vector<InformationEntry>& entries) {
  std::string text;
  for (const InformationEntry& e : entries)
    files::append_block(text, e.i, e.j, e.count, e.information, 8, "information");
  files::write_atomically(path, text);
}

}  // namespace gpureg::evaluation
