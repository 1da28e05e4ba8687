// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <clocale>
#include <random>

#include "gpureg/error.hpp"
#include "gpureg/evaluation.hpp"
#include "support/expect_error.hpp"
#include "support/limited_file_size.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::evaluation {
namespace {

using test::expect_error;
using test::TemporaryFolder;

const std::string kIdentity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

TEST(LogFile, RoundTripKeepsTenDecimals) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::vector<LogEntry> written;
  for (int k = 0; k < 500; ++k) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
            .normalized()
            .matrix();
    pose.translation() = 10000 * Eigen::Vector3d(normal(random), normal(random), normal(random));
    written.push_back({k, 3 * k + 1, 1501, pose.matrix()});
  }
  const TemporaryFolder folder;
  write_log(folder / "a.log", written);
  const std::vector<LogEntry> read = read_log(folder / "a.log");
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t k = 0; k < read.size(); ++k) {
    EXPECT_EQ(read[k].i, written[k].i);
    EXPECT_EQ(read[k].j, written[k].j);
    EXPECT_EQ(read[k].count, written[k].count);
    // Half a unit of the tenth decimal, and the last bit of a coordinate of 30 km.
    EXPECT_LE((read[k].transform - written[k].transform).cwiseAbs().maxCoeff(), 0.51e-10);
  }
}

TEST(LogFile, AnEmptyLogHasNoEntries) {
  const TemporaryFolder folder;
  write_log(folder / "a.log", {});
  EXPECT_TRUE(read_log(folder / "a.log").empty());
  EXPECT_TRUE(read_log(folder.write("b.log", "\n  \t\r\n\n")).empty());
}

TEST(LogFile, TakesTabsSpacesBlankLinesAndEveryLineEnding) {
  const TemporaryFolder folder;
  const std::string text =
      "\n0\t 2\t 57\t\r\n\r\n  1.0 0\t0 +1.5\r\n0 1 0 -2e0 \n\n0 0 1 .25\n0 0 0 1\n\n\n"
      "7 3 57\n1 0 0 0\n0 0 -1 0\n0 1 0 0\n0 0 0 1";  // no line end at the end of the file
  const std::vector<LogEntry> entries = read_log(folder.write("a.log", text));
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].j, 2);
  EXPECT_EQ(entries[0].count, 57);
  EXPECT_EQ(entries[0].transform.col(3), Eigen::Vector4d(1.5, -2, 0.25, 1));
  EXPECT_EQ(entries[1].i, 7);
  EXPECT_EQ(entries[1].transform(1, 2), -1);
}

TEST(LogFile, NamesFileAndLineOfMalformedBlocks) {
  const TemporaryFolder folder;
  const auto expect_bad = [&](const std::string& text, const std::string& line,
                              const std::string& reason) {
    SCOPED_TRACE(text);
    const std::string path = folder.write("bad.log", text);
    expect_error<IoError>([&] { read_log(path); }, {path + ":" + line + ":", reason});
  };
  expect_bad("0 1\n" + kIdentity, "1", "expected 3");
  expect_bad("0 1 57 9\n" + kIdentity, "1", "expected 3");
  expect_bad("0 x 57\n" + kIdentity, "1", "j is 'x'");
  expect_bad("0 1.5 57\n" + kIdentity, "1", "j is '1.5'");
  expect_bad("-1 1 57\n" + kIdentity, "1", "i is '-1'");
  expect_bad("0 99999999999 57\n" + kIdentity, "1", "j is '99999999999'");
  expect_bad("0 1 57\n1 0 0 0\n0 1 0 0\n", "3", "ends before row 3");
  expect_bad("0 1 57\n" + kIdentity + "0 2 57\n", "6",
             "ends before row 1 of the matrix of pair 0 2");
  expect_bad("0 1 57\n1 0 0\n", "2", "has 3 fields, expected 4");
  expect_bad("0 1 57\n1 0 0 0 0\n", "2", "has 5 fields, expected 4");
  expect_bad("0 1 57\n1 0 0 nan\n", "2", "finite");
  expect_bad("0 1 57\n1 0 0 -inf\n", "2", "finite");
  expect_bad("0 1 57\n1 0 0 1e999\n", "2", "expected a number");
  expect_bad("0 1 57\n1 0 0 0x10\n", "2", "'0x10'");
  expect_bad("0 1 57\n1 0 0 1,5\n", "2", "'1,5'");
  expect_bad("0 1 57\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n", "5", "last row");
  expect_bad("0 1 57\n2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n", "5", "rotation");
  expect_bad("0 1 57\n1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n", "5", "rotation");
  expect_bad("0 1 57\n\x1b[31m 0 0 0\n", "2", "'?[31m'");  // no terminal codes in messages
}

TEST(LogFile, MissingFilesAndFoldersAreNamed) {
  const TemporaryFolder folder;
  expect_error<IoError>([&] { read_log(folder / "none.log"); }, {"none.log", "No such file"});
  expect_error<IoError>([&] { read_log(folder.path()); }, {folder.path(), "folder"});
}

TEST(LogFile, RefusesToWriteUnreadableEntries) {
  const TemporaryFolder folder;
  LogEntry entry{3, 7, 9, Eigen::Matrix4d::Identity()};
  entry.transform(0, 3) = std::nan("");
  expect_error<InvalidArgument>([&] { write_log(folder / "a.log", {entry}); },
                                {"transform(0, 3)", "3\t7", "nan"});
  entry = {3, -7, 9, Eigen::Matrix4d::Identity()};
  expect_error<InvalidArgument>([&] { write_log(folder / "a.log", {entry}); }, {"-7", "negative"});
  EXPECT_EQ(folder.count(), 0u);
}

TEST(LogFile, FullDiskLeavesNoTruncatedLog) {
  const TemporaryFolder folder;
  const std::vector<LogEntry> entries(1000, LogEntry{0, 2, 57, Eigen::Matrix4d::Identity()});
  {
    const test::LimitedFileSize limit(4096);
    expect_error<IoError>([&] { write_log(folder / "a.log", entries); }, {"a.log"});
  }
  EXPECT_EQ(folder.count(), 0u);
}

TEST(LogFile, DoesNotDependOnTheLocale) {
  const char* german = std::setlocale(LC_NUMERIC, "de_DE.UTF-8");
  const TemporaryFolder folder;
  LogEntry entry{0, 2, 3, Eigen::Matrix4d::Identity()};
  entry.transform(0, 3) = 1.25;
  write_log(folder / "a.log", {entry});
  const double read = read_log(folder / "a.log").at(0).transform(0, 3);
  std::setlocale(LC_NUMERIC, "C");
  if (german == nullptr) GTEST_SKIP() << "this machine has no locale with a decimal comma";
  EXPECT_EQ(read, 1.25);
}

}  // namespace
}  // namespace gpureg::evaluation
