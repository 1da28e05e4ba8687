// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

namespace fs = std::filesystem;
using test::expect_error;
using test::TemporaryFolder;

using Words = std::vector<std::string>;

Words names(const std::vector<ScanFile>& scans) {
  Words out;
  for (const ScanFile& scan : scans) out.push_back(scan.name);
  return out;
}

std::vector<int> numbers(const std::vector<ScanFile>& scans) {
  std::vector<int> out;
  for (const ScanFile& scan : scans) out.push_back(scan.number);
  return out;
}

void touch(const TemporaryFolder& folder, const Words& files) {
  for (const std::string& file : files) {
    fs::create_directories(fs::path(folder / file).parent_path());
    folder.write(file, "");
  }
}

TEST(Fragments, AreOrderedByNumberNotByName) {
  const TemporaryFolder folder;
  touch(folder, {"cloud_bin_10.ply", "cloud_bin_2.ply", "cloud_bin_0.pcd", "cloud_bin_007.ply",
                 "cloud_bin_100.ply", "cloud_bin_11.bin", "cloud_bin_12.stl", "cloud_bin_13.obj"});
  touch(folder,
        {"gt.log", "cloud_bin_.ply", "cloud_bin_3.txt", "cloud_bin_x.ply", "cloud_bin_1.ply.bak",
         "cloud_bin_-4.ply", "cloud_bin_5a.ply", "xcloud_bin_6.ply", "cloud_bin_99999999999.ply"});
  fs::create_directory(folder / "cloud_bin_8.ply");
  fs::create_symlink(folder / "nowhere", folder / "cloud_bin_9.ply");
  Words notes;
  const auto fragments = list_scans(folder.path(), false, &notes);
  for (const ScanFile& scan : fragments) EXPECT_TRUE(fs::is_regular_file(scan.path));
  EXPECT_EQ(numbers(fragments), (std::vector<int>{0, 2, 7, 10, 11, 12, 13, 100}));
  EXPECT_EQ(fragments[0].path, folder / "cloud_bin_0.pcd");
  EXPECT_EQ(fragments[0].name, "cloud_bin_0.pcd");
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("6 other clouds"), std::string::npos) << notes[0];
}

TEST(Fragments, ANumberTwiceIsAnError) {
  const TemporaryFolder folder;
  touch(folder, {"cloud_bin_3.ply", "cloud_bin_3.pcd"});
  expect_error<IoError>([&] { list_scans(folder.path()); },
                        {"fragment 3 is twice", "cloud_bin_3.ply", "cloud_bin_3.pcd"});
  fs::remove(folder / "cloud_bin_3.pcd");
  touch(folder, {"cloud_bin_03.ply"});
  expect_error<IoError>([&] { list_scans(folder.path()); },
                        {"fragment 3 is twice", "cloud_bin_03.ply"});
}

TEST(Fragments, TheLargestNumberLeavesRoomForACount) {
  const TemporaryFolder folder;
  touch(folder, {"cloud_bin_2147483646.ply"});
  EXPECT_EQ(list_scans(folder.path()).at(0).number, 2147483646);
  touch(folder, {"cloud_bin_2147483647.ply"});
  expect_error<IoError>([&] { list_scans(folder.path()); },
                        {"cloud_bin_2147483647.ply", "at most 2147483646"});
}

TEST(Scans, AnyFolderInNaturalOrder) {
  const TemporaryFolder folder;
  touch(folder, {"Hall 10.PLY", "hall 9.ply", "hall 2.pcd", ".hidden.ply", "._hall 2.pcd",
                 "annex.STL", "notes.md", "photo.jpg"});
  folder.write("poses.txt", "0 0 0 0 0 0 0 1\n");
  folder.write("points.txt", "// x y z\n1 2 3\n");
  folder.write("numbers.csv", "1,2,3,255\n");
  folder.write("table.csv", "name,rooms\nhall,3\n");
  fs::create_symlink(folder / "nowhere", folder / "lost.ply");
  Words notes;
  const auto scans = list_scans(folder.path(), false, &notes);
  EXPECT_EQ(names(scans), (Words{"annex.STL", "hall 2.pcd", "hall 9.ply", "Hall 10.PLY",
                                 "numbers.csv", "points.txt"}));
  EXPECT_EQ(numbers(scans), (std::vector<int>{0, 1, 2, 3, 4, 5}));
  ASSERT_EQ(notes.size(), 2u);
  EXPECT_EQ(notes[0], "3 files that are no clouds are skipped in " + folder.path() +
                          ": notes.md, photo.jpg, table.csv");
  EXPECT_EQ(notes[1], "1 link to nothing is skipped in " + folder.path() + ": lost.ply");
}

TEST(Scans, NamesThatDifferByANumberKeepIt) {
  const TemporaryFolder folder;
  touch(folder, {"scan_2.ply", "scan_10.ply", "scan_011.pcd"});
  EXPECT_EQ(numbers(list_scans(folder.path())), (std::vector<int>{2, 10, 11}));
  // One more, and they have none of their own.
  touch(folder, {"entrance.ply"});
  EXPECT_EQ(numbers(list_scans(folder.path())), (std::vector<int>{0, 1, 2, 3}));
  const TemporaryFolder times;
  touch(times, {"1403636579763555584.pcd", "1403636579813555456.pcd"});
  EXPECT_EQ(numbers(list_scans(times.path())), (std::vector<int>{0, 1}));
}

TEST(Scans, OneScanInTwoFormatsIsRefused) {
  const TemporaryFolder folder;
  touch(folder, {"a.ply", "b.ply", "a.pcd"});
  expect_error<IoError>([&] { list_scans(folder.path()); },
                        {"a.pcd and a.ply", "one scan in two formats", "/*.ply'"});
  EXPECT_EQ(names(list_scans(folder / "*.ply")), (Words{"a.ply", "b.ply"}));
  fs::remove(folder / "a.pcd");
  folder.write("a.txt", "1 2 3\n");  // describes a.ply, whatever it holds
  EXPECT_EQ(names(list_scans(folder.path())), (Words{"a.ply", "b.ply"}));
}

TEST(Scans, OfSubfoldersOnRequest) {
  const TemporaryFolder folder;
  touch(folder, {"floor2/a.ply", "floor10/a.ply", "floor2/b/c.ply", ".git/d.ply", "map/map.ply",
                 "map/reconstruction.json"});
  expect_error<IoError>([&] { list_scans(folder.path()); },
                        {"has no clouds itself", "in subfolders", "floor2/a.ply", "one of them",
                         "--recursive", "recursive=True"});
  fs::create_symlink(folder.path(), folder / "floor2/round");
  Words notes;
  const auto scans = list_scans(folder.path(), true, &notes);
  EXPECT_EQ(names(scans), (Words{"floor2/a.ply", "floor2/b/c.ply", "floor10/a.ply"}));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("1 output of `gpureg reconstruct` is skipped"), std::string::npos);
  expect_error<IoError>([&] { list_scans(folder / "map"); },
                        {"is the output of `gpureg reconstruct`"});
  expect_error<IoError>([&] { list_scans(folder / "floor2/a.ply", true); }, {"is no folder"});
}

TEST(Scans, LayoutsOfDataSets) {
  const TemporaryFolder kitti;
  touch(kitti, {"00/velodyne/000000.bin", "00/velodyne/000010.bin", "00/image_2/000000.png",
                "00/calib.txt", "00/times.txt", "poses.txt"});
  expect_error<IoError>([&] { list_scans(kitti / "00"); },
                        {"2 in subfolders", "give " + kitti / "00/velodyne"});
  EXPECT_EQ(numbers(list_scans(kitti / "00/velodyne")), (std::vector<int>{0, 10}));

  const TemporaryFolder asl;
  asl.write("Hokuyo_0.csv", "timestamp,point_id,x,y,z,intensity\n1,1,0.5,1,2,9\n");
  asl.write("Hokuyo_1.csv", "x,y,z\n0.5,1,2\n");
  asl.write("pose_scanner_leica.csv", "poseId, timestamp, T00, T01\n0, 1, 2, 3\n");
  EXPECT_EQ(names(list_scans(asl.path())), (Words{"Hokuyo_0.csv", "Hokuyo_1.csv"}));

  const TemporaryFolder nuscenes;
  touch(nuscenes, {"n015-2018-07-24+0800__LIDAR_TOP__1532402927647951.pcd.bin",
                   "n015-2018-07-24+0800__LIDAR_TOP__1532402928147847.pcd.bin"});
  EXPECT_EQ(numbers(list_scans(nuscenes.path())), (std::vector<int>{0, 1}));

  const TemporaryFolder tum;
  touch(tum, {"depth/1305031102.160407.png", "rgb/1305031102.175304.png", "depth.txt"});
  tum.write("groundtruth.txt", "# time tx ty tz qx qy qz qw\n1.5 1 2 3 0 0 0 1\n");
  expect_error<IoError>(
      [&] { list_scans(tum.path()); },
      {"2 files (depth/1305031102.160407.png, rgb/1305031102.175304.png), each an image"});
  expect_error<IoError>([&] { list_scans(tum / "depth"); },
                        {"1 file (1305031102.160407.png), an image", "from_depth_image"});

  const TemporaryFolder bags;
  touch(bags, {"drive.bag", "drive_0.mcap"});
  expect_error<IoError>([&] { list_scans(bags.path()); },
                        {"2 files (drive.bag, drive_0.mcap), each a recording", "rosbags"});
  expect_error<IoError>([&] { list_scans(bags / "drive.bag"); }, {"is a recording", "rosbags"});

  const TemporaryFolder packed;
  touch(packed, {"scans.zip"});
  expect_error<IoError>([&] { list_scans(packed.path()); },
                        {"1 file (scans.zip), compressed", "unpack"});
  const TemporaryFolder faro;
  touch(faro, {"a.fls", "b.fls"});
  expect_error<IoError>([&] { list_scans(faro.path()); },
                        {"2 files (a.fls, b.fls), each a project", "E57"});
}

TEST(Scans, FoldersWithoutAnySayWhatTheyHold) {
  const TemporaryFolder folder;
  expect_error<IoError>([&] { list_scans(folder.path()); }, {folder.path(), "is empty", "PLY"});
  expect_error<IoError>([&] { list_scans(folder / "none"); }, {"none", "No such file"});
  fs::create_symlink(folder / "nowhere", folder / "a.ply");
  expect_error<IoError>([&] { list_scans(folder.path()); }, {"links to files that are not there"});
  expect_error<IoError>([&] { list_scans(folder / "a.ply"); }, {"link to nothing"});
  touch(folder, {"a.doc", "b.doc", "c.doc", "d.doc", "e.doc"});
  fs::remove(folder / "a.ply");
  expect_error<IoError>([&] { list_scans(folder.path()); },
                        {"5 files that are none (a.doc, b.doc, c.doc and 2 more)", "expected PLY"});
}

TEST(Scans, OneFileIsNotSeveral) {
  const TemporaryFolder folder;
  touch(folder, {"a.ply"});
  expect_error<IoError>([&] { list_scans(folder / "a.ply"); },
                        {"is one cloud", "folder", "list", "pattern in quotes"});
  expect_error<IoError>([&] { list_scans(folder.write("points.txt", "1 2 3\n")); },
                        {"is one cloud"});
}

TEST(Scans, Patterns) {
  const TemporaryFolder folder;
  touch(folder, {"a/s2.ply", "a/s10.ply", "a/t.pcd", "b/s2.ply", "a/s.md", "[x]/y.ply"});
  EXPECT_EQ(names(list_scans(folder / "a/s*.ply")), (Words{"s2.ply", "s10.ply"}));
  EXPECT_EQ(names(list_scans(folder / "*/s2.ply")), (Words{"a/s2.ply", "b/s2.ply"}));
  EXPECT_EQ(names(list_scans(folder / "**/*.ply")),
            (Words{"[x]/y.ply", "a/s2.ply", "a/s10.ply", "b/s2.ply"}));
  EXPECT_EQ(names(list_scans(folder / "a/{s2.ply,t.pcd}*")), (Words{"s2.ply", "t.pcd"}));
  Words notes;
  EXPECT_EQ(list_scans(folder / "a/*", false, &notes).size(), 3u);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("s.md"), std::string::npos);
  EXPECT_EQ(names(list_scans(folder / "[x]")), (Words{"y.ply"}));  // a folder, not a pattern
  expect_error<IoError>([&] { list_scans(folder / "c*.ply"); }, {"no file matches", "c*.ply"});
  expect_error<IoError>([&] { list_scans(folder / "?"); }, {"folders do", "?/*'"});
  expect_error<IoError>([&] { list_scans(folder / "a/*.md"); }, {"no cloud matches", "s.md"});
}

TEST(Scans, Lists) {
  const TemporaryFolder folder;
  touch(folder, {"far/the hall.ply", "b.ply", "a.ply", "c.ply"});
  const std::string list = folder.write(
      "scans.txt",
      "\xEF\xBB\xBF# in this order\r\nc.ply\r\n\r\nfar/the hall.ply  Great \"Hall\"\n\"b.ply\"\n" +
          folder / "a.ply" + "\tfirst\n");
  const auto scans = list_scans(list);
  EXPECT_EQ(names(scans), (Words{"c.ply", "Great \"Hall\"", "b.ply", "first"}));
  EXPECT_EQ(numbers(scans), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(scans[1].path, folder / "far/the hall.ply");
  const auto refused = [&](const std::string& text, std::initializer_list<std::string> parts) {
    SCOPED_TRACE(text);
    const std::string bad = folder.write("bad.txt", text);
    expect_error<IoError>([&] { list_scans(bad); }, parts);
  };
  refused("a.ply\nnone.ply hall\n", {"bad.txt:2:", "there is no file", "none.ply hall"});
  refused("a.ply\nb.ply\n./a.ply\n", {"bad.txt:3: repeats line 1"});
  refused("a.ply\nb.ply a.ply\n", {"bad.txt:2: has the name a.ply of line 1"});
  refused("far\n", {"bad.txt:1:", "is a folder"});
  refused("none.e57#3\n", {"bad.txt:1:", "there is no file"});
  refused("# nothing\n", {"lists no cloud"});
  refused(std::string("a\0b", 3), {"is no list of clouds"});
}

TEST(Scans, NamesAreTextWhateverTheFileIsCalled) {
  const TemporaryFolder folder;
  touch(folder, {"b\xFF.ply", "line\nbreak.ply", "caf\xC3\xA9 <b>,\".ply", "\xE5\x8E\xA8.ply"});
  EXPECT_EQ(names(list_scans(folder.path())),
            (Words{"b?.ply", "caf\xC3\xA9 <b>,\".ply", "line?break.ply", "\xE5\x8E\xA8.ply"}));
}

TEST(Scans, AreFoundByNumberOrName) {
  const std::vector<ScanFile> scans = {{3, "", "floor/a.ply"},
                                       {4, "", "floor/b.ply"},
                                       {5, "", "roof/a.ply"},
                                       {6, "", "c.ptx#2"},
                                       {7, "", "1305031102.175304.ply"}};
  EXPECT_EQ(find_scan(scans, "4"), 1u);
  EXPECT_EQ(find_scan(scans, "floor/a.ply"), 0u);
  EXPECT_EQ(find_scan(scans, "floor/a"), 0u);
  EXPECT_EQ(find_scan(scans, "b.ply"), 1u);
  EXPECT_EQ(find_scan(scans, "b"), 1u);
  EXPECT_EQ(find_scan(scans, "c.ptx#2"), 3u);
  EXPECT_EQ(find_scan(scans, "1305031102.175304"), 4u);
  for (const char* none : {"a.ply", "a", "0", "99999999999", "", "d"})
    EXPECT_FALSE(find_scan(scans, none)) << none;
}

TEST(Scans, ListsOfPairsAndCamerasHaveNames) {
  const TemporaryFolder folder;
  const std::vector<ScanFile> scans = {
      {0, "", "great hall.ply"}, {1, "", "hall.ply"}, {2, "", "tower.ptx#2"}};
  EXPECT_EQ(read_pairs(folder.write("pairs.txt",
                                    "# names\ngreat hall.ply hall.ply # both\n2 great hall\n"
                                    "hall tower.ptx#2\n0 1\n"),
                       scans),
            (std::vector<std::pair<int, int>>{{0, 1}, {2, 0}, {1, 2}, {0, 1}}));
  const auto refused = [&](const std::string& line, std::initializer_list<std::string> parts) {
    SCOPED_TRACE(line);
    const std::string path = folder.write("pairs.txt", line);
    expect_error<IoError>([&] { read_pairs(path, scans); }, parts);
  };
  refused("0 7\n", {"pairs.txt:1: there is no fragment 7"});
  refused("hall moat.ply\n", {"pairs.txt:1: there is no scan named 'moat.ply'"});
  refused("great moat tower\n", {"pairs.txt:1:", "names no two scans"});
  refused("hall hall.ply\n", {"paired with itself"});
  refused("hall\n", {"expected 2"});
  const auto cameras = read_cameras(
      folder.write("cameras.txt",
                   "great hall.ply 0 1 2 3 0 0 0 1\n1 0 4 5 6 0 0 0 1\ntower.ptx#2 0 7 8 9 0 0 0 "
                   "1\nmoat.ply 0 0 0 0 0 0 0 1\n"),
      scans);
  EXPECT_EQ(cameras.size(), 3u);
  EXPECT_EQ(cameras.at(0).at(0), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(cameras.at(2).at(0), Eigen::Vector3d(7, 8, 9));
}

}  // namespace
}  // namespace gpureg::io
