// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

using test::expect_error;
using test::TemporaryFolder;

TEST(Fragments, AreOrderedByNumberNotByName) {
  const TemporaryFolder folder;
  for (const char* name :
       {"cloud_bin_10.ply", "cloud_bin_2.ply", "cloud_bin_0.pcd", "cloud_bin_007.ply",
        "cloud_bin_100.ply", "cloud_bin_11.bin", "cloud_bin_12.stl", "cloud_bin_13.obj"})
    folder.write(name, "");
  for (const char* name :
       {"gt.log", "cloud_bin_.ply", "cloud_bin_3.txt", "cloud_bin_x.ply", "cloud_bin_1.ply.bak",
        "cloud_bin_-4.ply", "cloud_bin_5a.ply", "xcloud_bin_6.ply", "cloud_bin_99999999999.ply"})
    folder.write(name, "");
  std::filesystem::create_directory(folder / "cloud_bin_8.ply");
  std::filesystem::create_symlink(folder / "nowhere", folder / "cloud_bin_9.ply");
  const auto fragments = list_fragments(folder.path());
  std::vector<int> numbers;
  for (const auto& [number, path] : fragments) {
    numbers.push_back(number);
    EXPECT_TRUE(std::filesystem::is_regular_file(path));
  }
  EXPECT_EQ(numbers, (std::vector<int>{0, 2, 7, 10, 11, 12, 13, 100}));
  EXPECT_EQ(fragments[0].second, folder / "cloud_bin_0.pcd");
}

TEST(Fragments, ANumberTwiceIsAnError) {
  const TemporaryFolder folder;
  folder.write("cloud_bin_3.ply", "");
  folder.write("cloud_bin_3.pcd", "");
  expect_error<IoError>([&] { list_fragments(folder.path()); },
                        {"fragment 3 is twice", "cloud_bin_3.ply", "cloud_bin_3.pcd"});
  std::filesystem::remove(folder / "cloud_bin_3.pcd");
  folder.write("cloud_bin_03.ply", "");
  expect_error<IoError>([&] { list_fragments(folder.path()); },
                        {"fragment 3 is twice", "cloud_bin_03.ply"});
}

TEST(Fragments, AFolderWithoutAnyIsAnError) {
  const TemporaryFolder folder;
  expect_error<IoError>([&] { list_fragments(folder.path()); }, {"no fragments", folder.path()});
  expect_error<IoError>([&] { list_fragments(folder / "none"); }, {"none", "No such file"});
  expect_error<IoError>([&] { list_fragments(folder.write("file", "")); },
                        {"file", "Not a directory"});
}

TEST(Fragments, TheLargestNumberLeavesRoomForACount) {
  const test::TemporaryFolder folder;
  folder.write("cloud_bin_2147483646.ply", "");
  EXPECT_EQ(list_fragments(folder.path()).at(0).first, 2147483646);
  folder.write("cloud_bin_2147483647.ply", "");
  test::expect_error<IoError>([&] { list_fragments(folder.path()); },
                              {"cloud_bin_2147483647.ply", "at most 2147483646"});
}

}  // namespace
}  // namespace gpureg::io
