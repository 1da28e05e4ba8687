// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/block_file.hpp"
#include "evaluation/rigid.hpp"
#include "gpureg/evaluation.hpp"
#include "gpureg/files.hpp"

namespace gpureg::evaluation {
std::vector<LogEntry> read_log(const std::string& path) {
  std::vector<LogEntry> entries;
  files::read_blocks<4>(path, [&](const files::TextFile& file, int i, int j, int n,
                                  const Eigen::Matrix4d& transform, int line) {
    check_rigid(file, transform);
    entries.push_back({i, j, n, transform, line});
  });
  return entries;
}

void write_log(const std::string& path, const std::vector<LogEntry>& entries) {
  std::string text;
  for (const LogEntry& e : entries)
    files::append_block(text, e.i, e.j, e.count, e.transform, 10, "transform");
  files::write_atomically(path, text);
}

}  // namespace gpureg::evaluation
