// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::evaluation {
namespace {

using test::expect_error;
using test::TemporaryFolder;

LogEntry entry_of(int i, int j, int count = 9) {
  return {i, j, count, Eigen::Matrix4d::Identity()};
}

std::vector<LogEntry> written_and_read(const TemporaryFolder& folder,
                                       const std::vector<LogEntry>& entries) {
  write_log(folder / "a.log", entries);
  return read_log(folder / "a.log");
}

TEST(CheckEntries, EntriesKnowTheirLine) {
  const TemporaryFolder folder;
  const auto entries = written_and_read(folder, {entry_of(0, 1), entry_of(8, 2), entry_of(2, 8)});
  EXPECT_EQ(entries[0].line, 1);
  EXPECT_EQ(entries[2].line, 11);
  check_entries("a.log", entries);
  check_entries("a.log", std::vector<LogEntry>());
  std::vector<InformationEntry> information(2);
  information[0].j = information[1].j = 1;
  information[0].count = information[1].count = 2;
  information[1].i = 0;
  information[1].j = 1;
  information[0].i = 1;
  information[0].j = 0;
  write_information(folder / "a.info", information);
  EXPECT_EQ(read_information(folder / "a.info")[1].line, 8);
  check_entries("a.info", information);
}

TEST(CheckEntries, NamesInconsistentBlocks) {
  const TemporaryFolder folder;
  const auto expect_bad = [&](const std::vector<LogEntry>& entries,
                              std::initializer_list<std::string> fragments) {
    const auto read = written_and_read(folder, entries);
    expect_error<IoError>([&] { check_entries("a.log", read); }, fragments);
  };
  expect_bad({entry_of(0, 2), entry_of(0, 3, 8)},
             {"a.log:6:", "pair 0 3", "8 fragments", "says 9"});
  expect_bad({entry_of(0, 9)}, {"a.log:1:", "pair 0 9", "out of range", "9 fragments"});
  expect_bad({entry_of(0, 2), entry_of(9, 1)}, {"a.log:6:", "pair 9 1", "out of range"});
  expect_bad({entry_of(3, 3)}, {"a.log:1:", "pair 3 3", "itself"});
  expect_bad({entry_of(0, 2), entry_of(0, 3), entry_of(0, 2)},
             {"a.log:11:", "pair 0 2", "stands twice, first in line 1"});
}

}  // namespace
}  // namespace gpureg::evaluation
