// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

using test::expect_error;
using test::TemporaryFolder;

TEST(Cameras, PositionsByFragmentInTheOrderOfTheFile) {
  const TemporaryFolder folder;
  const auto cameras =
      read_cameras(folder.write("cameras.txt",
                                "# fragment frame t q\n2 100 1 2 3 0 0 0 1\n\n0 0 -0.5 0 0 0.6 0 "
                                "0.8 0 # turned\r\n2\t101\t4 5 6 0 0 0 -1\n"));
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras.at(0), (std::vector<Eigen::Vector3d>{{-0.5, 0, 0}}));
  EXPECT_EQ(cameras.at(2), (std::vector<Eigen::Vector3d>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_TRUE(read_cameras(folder.write("empty.txt", "")).empty());
}

TEST(Cameras, NamesFileAndLineOfMalformedLines) {
  const TemporaryFolder folder;
  const auto expect_bad = [&](const std::string& line, const std::string& reason) {
    SCOPED_TRACE(line);
    const std::string path = folder.write("cameras.txt", "0 0 1 2 3 0 0 0 1\n" + line);
    expect_error<IoError>([&] { read_cameras(path); }, {path + ":2:", reason});
  };
  expect_bad("0 1 1 2 3 0 0 0", "has 8 fields, expected 9");
  expect_bad("0 1 1 2 3 0 0 0 1 1", "has 10 fields");
  expect_bad("0.5 1 1 2 3 0 0 0 1", "fragment is '0.5'");
  expect_bad("0 -1 1 2 3 0 0 0 1", "frame is '-1'");
  expect_bad("0 1 1 two 3 0 0 0 1", "ty is 'two'");
  expect_bad("0 1 1 2 nan 0 0 0 1", "tz is 'nan'");
  expect_bad("0 1 1e200 2 3 0 0 0 1", "farther away");
  expect_bad("0 1 1 2 3 0 0 0 0", "quaternion");
  expect_bad("0 1 1 2 3 0.9 0 0 0.9", "quaternion");
  expect_error<IoError>([&] { read_cameras(folder / "none.txt"); }, {"none.txt", "No such file"});
}

TEST(Pairs, InTheOrderOfTheFile) {
  const TemporaryFolder folder;
  const auto pairs = read_pairs(folder.write("pairs.txt", "# i j\n3 4\n\n 0\t9 # a loop\r\n5 1"));
  EXPECT_EQ(pairs, (std::vector<std::pair<int, int>>{{3, 4}, {0, 9}, {5, 1}}));
}

TEST(Pairs, NamesFileAndLineOfMalformedLines) {
  const TemporaryFolder folder;
  const auto expect_bad = [&](const std::string& line, const std::string& reason) {
    SCOPED_TRACE(line);
    const std::string path = folder.write("pairs.txt", "# i j\n" + line);
    expect_error<IoError>([&] { read_pairs(path); }, {path + ":2:", reason});
  };
  expect_bad("1", "has 1 fields, expected 2");
  expect_bad("1 2 3", "has 3 fields");
  expect_bad("1 b", "j is 'b'");
  expect_bad("-1 2", "i is '-1'");
  expect_bad("4 4", "paired with itself");
}

}  // namespace
}  // namespace gpureg::io
