// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"
#include "io/seed_files.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

using test::expect_error;
using test::pcd_header;
using test::ply_header;
using test::raw;
using test::raw_points;
using test::replaced;
using test::TemporaryFolder;

void expect_bad(const std::string& content, std::initializer_list<std::string> fragments) {
  SCOPED_TRACE(content);
  const TemporaryFolder folder;
  const std::string path = folder.write("cloud_bin_7.ply", content);
  expect_error<IoError>([&] { read_point_cloud(path); }, fragments);
  expect_error<IoError>([&] { read_point_cloud(path); }, {path});
}

TEST(BadFile, MissingEmptyOrSomethingElse) {
  const TemporaryFolder folder;
  expect_error<IoError>([&] { read_point_cloud(folder / "none.ply"); },
                        {"none.ply", "No such file"});
  expect_error<IoError>([&] { read_point_cloud(folder.path()); }, {folder.path(), "folder"});
  expect_bad("", {"empty"});
  expect_bad("\x89PNG\r\n", {"an image"});
  expect_bad("1 2 3\n4 5 6\n", {"neither a PLY nor a PCD"});
  expect_bad("# only a comment", {"neither a PLY nor a PCD"});
}

// A device has no end, and a pipe to which nobody writes waits for ever.
TEST(BadFile, DevicesAndPipes) {
  const TemporaryFolder folder;
  const std::string pipe = folder / "pipe.ply";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& path : {std::string("/dev/zero"), pipe}) {
    EXPECT_FALSE(is_mesh(path));
    expect_error<IoError>([&] { read_point_cloud(path); }, {path, "not a regular file"});
    expect_error<IoError>([&] { read_mesh(path); }, {path, "not a regular file"});
  }
}

// Sparse: it takes no room. Without a header it is not read as a whole.
TEST(BadFile, LargeFilesWithoutAHeader) {
  const TemporaryFolder folder;
  const std::string path = folder.write("cloud.ply", "");
  std::filesystem::resize_file(path, std::uintmax_t{1} << 35);
  expect_error<IoError>([&] { read_point_cloud(path); }, {path, "neither a PLY nor a PCD"});
}

TEST(BadFile, TruncatedBinaryPly) {
  const std::string whole = ply_header("binary_little_endian", 100, "float", true) +
                            "end_header\n" + raw_points<float>(100, false, true);
  for (const std::size_t missing : {1u, 23u, 24u, 1000u, 2400u})
    expect_bad(
        whole.substr(0, whole.size() - missing),
        {"truncated", "100 of element vertex", std::to_string(2400 - missing) + " bytes follow"});
}

TEST(BadFile, TruncatedTextPly) {
  const std::string header = ply_header("ascii", 3, "float", false) + "end_header\n";
  expect_bad(header, {"truncated", "3 rows"});
  expect_bad(header + "1.5 1.5 1.5\n1.5 1.5 1.5\n", {"truncated", "ends after 2"});
  expect_bad(header + "1.5 1.5 1.5\n1.5 1.5 1.5\n1 1",
             {":10:", "point 3 has 2 values, expected 3"});
}

TEST(BadFile, HeadersThatLieAboutTheCount) {
  const std::string body = raw_points<float>(10, false, false);
  const auto with_count = [&](const char* count) {
    return replaced(ply_header("binary_little_endian", 10, "float", false), "vertex 10",
                    std::string("vertex ") + count) +
           "end_header\n" + body;
  };
  expect_bad(with_count("11"), {"truncated", "11 of element vertex"});
  expect_bad(with_count("9"), {"12 bytes more", "9 of element vertex"});
  expect_bad(with_count("2000000000"), {"truncated"});
  expect_bad(with_count("3000000000"), {"3000000000 points", "limit"});
  expect_bad(with_count("999999999999999999"), {"limit"});
  expect_bad(with_count("18446744073709551615"), {"count of an element"});
  expect_bad(with_count("-1"), {":3:", "'-1'"});
  expect_bad(with_count("1e3"), {":3:", "'1e3'"});
  const std::string text = ply_header("ascii", 10, "float", false) + "end_header\n";
  expect_bad(replaced(text, "vertex 10", "vertex 1000000000") + "1 2 3\n",
             {"truncated", "1000000000 rows"});
}

TEST(BadFile, PlyHeaders) {
  const std::string good = ply_header("ascii", 1, "float", false);
  const std::string end = "end_header\n1 2 3\n";
  expect_bad(good + "1 2 3\n", {"unknown keyword '1'"});
  expect_bad(good, {"no line: end_header"});
  expect_bad("ply", {"no line: end_header"});
  expect_bad("plywood\n" + good + end, {":1:", "first line"});
  expect_bad(replaced(good, "property float z\n", "") + end, {"no coordinate z"});
  expect_bad(replaced(good, "property float z\n", "property float x\n") + end, {"x twice"});
  expect_bad(replaced(good, "property float z", "property flaot z") + end, {":6:", "'flaot'"});
  expect_bad(replaced(good, "property float z", "property float") + end,
             {":6:", "expected: property"});
  expect_bad(replaced(good, "property float z", "property list uchar float z") + end,
             {"no coordinate z, only 'x', 'y'"});
  expect_bad(replaced(good, "property float z", "property list float float z") + end,
             {":6:", "count of a list"});
  expect_bad(replaced(good, "element vertex 1", "element point 1") + end,
             {"0 elements named vertex"});
  expect_bad(good + "element vertex 1\n" + end, {"2 elements named vertex"});
  expect_bad(replaced(good, "element vertex 1\n", "") + end,
             {":3:", "property before any element"});
  expect_bad(replaced(good, "format ascii 1.0\n", "") + end, {"without a line: format"});
  expect_bad(replaced(good, "ascii 1.0", "ascii 2.0") + end, {":2:", "1.0"});
  expect_bad(replaced(good, "ascii", "utf8") + end, {":2:", "'utf8'"});
  expect_bad(good + "format ascii 1.0\n" + end, {"second line: format"});
}

TEST(BadFile, PlyBodies) {
  const std::string header = ply_header("ascii", 2, "float", false) + "end_header\n";
  expect_bad(header + "1 2 3\n4 x 6\n", {":9:", "y is 'x'"});
  expect_bad(header + "1 2 3\n4 5 6 7\n", {":9:", "point 2 has 4 values"});
  expect_bad(header + "1 2 3\n4 5,0 6\n", {":9:", "'5,0'"});
  expect_bad(header + std::string("1 2 3\n\0 \0 \0\n", 12), {":9:", "'?'"});
}

TEST(BadFile, ListsThatLie) {
  const std::string header = "element face 1\nproperty list int int vertex_indices\nend_header\n";
  const std::string ply = ply_header("binary_little_endian", 1, "float", false) + header +
                          raw_points<float>(1, false, false);
  expect_bad(ply, {"truncated", "element face"});
  expect_bad(ply + raw(-1), {"negative count"});
  expect_bad(ply + raw(2147483647), {"truncated", "element face"});
  expect_bad(ply + raw(2) + raw(0), {"truncated", "element face"});
  expect_bad(replaced(ply, "face 1", "face 999999999999999999") + raw(0),
             {"truncated", "element face"});
}

TEST(BadFile, PcdHeaders) {
  const std::string good = pcd_header(2, "ascii");
  const std::string body = "1 2 3\n4 5 6\n";
  expect_bad(replaced(good, "DATA ascii\n", "") + body, {"unknown keyword '1'"});
  expect_bad(replaced(good, "DATA ascii\n", ""), {"no line: DATA"});
  expect_bad(replaced(good, "DATA ascii", "DATA zip") + body, {":11:", "expected: DATA"});
  expect_bad(replaced(good, "x y z", "x y w") + body, {"no coordinate z"});
  expect_bad(replaced(good, "x y z", "x y x") + body, {"x twice"});
  expect_bad(replaced(good, "FIELDS x y z\n", "FIELDS\n") + body, {"no line: FIELDS"});
  expect_bad(replaced(good, "SIZE 4 4 4", "SIZE 4 4") + body,
             {"SIZE has 2 entries, but FIELDS has 3"});
  expect_bad(replaced(good, "TYPE F F F", "TYPE F F F F") + body, {"TYPE has 4 entries"});
  expect_bad(replaced(good, "COUNT 1 1 1", "COUNT 1 1") + body, {"COUNT has 2 entries"});
  expect_bad(replaced(good, "COUNT 1 1 1", "COUNT 1 1 0") + body, {"COUNT '0'"});
  expect_bad(replaced(good, "COUNT 1 1 1", "COUNT 2 1 1") + "1 1 2 3\n4 4 5 6\n",
             {"x several values"});
  expect_bad(replaced(good, "SIZE 4 4 4", "SIZE 4 3 4") + body, {"'y'", "size '3'"});
  expect_bad(replaced(good, "TYPE F F F", "TYPE F F C") + body, {"'z'", "type 'C'"});
  expect_bad(replaced(good, "SIZE 4 4 4", "SIZE 4 4 2") + body, {"'z'", "size '2'"});
  expect_bad(replaced(good, "POINTS 2", "POINTS 3") + body,
             {"WIDTH x HEIGHT is 2, but POINTS is 3"});
  expect_bad(replaced(good, "WIDTH 2", "WIDTH two") + body, {":7:", "expected: WIDTH"});
  expect_bad(replaced(good, "VIEWPOINT 0 0 0 1 0 0 0", "VIEWPOINT 0 0 inf 1 0 0 0") + body,
             {":9:", "'inf'"});
  expect_bad(replaced(replaced(good, "WIDTH 2\n", ""), "POINTS 2\n", "") + body,
             {"neither WIDTH nor POINTS"});
}

TEST(BadFile, PcdCountsThatLie) {
  const std::string body = raw_points<float>(4, false, false);
  expect_bad(pcd_header(5, "binary") + body,
             {"truncated", "5 points of 12 bytes", "48 bytes follow"});
  expect_bad(pcd_header(3, "binary") + body, {"3 points of 12 bytes", "48 bytes follow"});
  expect_bad(pcd_header(2000000000, "binary") + body, {"truncated"});
  expect_bad(replaced(replaced(pcd_header(4, "binary"), "WIDTH 4", "WIDTH 99999999999"), "POINTS 4",
                      "POINTS 99999999999") +
                 body,
             {"limit"});
  expect_bad(pcd_header(3, "ascii") + "1.5 2.5 3.5\n1.5 2.5 3.5\n", {"truncated", "ends after 2"});
}

TEST(BadFile, PcdCompression) {
  const std::string packed = test::pack_literally(raw_points<float>(4, false, false));
  const auto size = static_cast<std::uint32_t>(packed.size());
  const std::string header = pcd_header(4, "binary_compressed");
  expect_bad(header, {"truncated", "sizes"});
  expect_bad(header + raw(size) + raw(std::uint32_t{48}) + packed.substr(1),
             {"truncated", "compressed data"});
  expect_bad(header + raw(size) + raw(std::uint32_t{36}) + packed, {"hold 36 bytes", "4 points"});
  expect_bad(header + raw(size - 1) + raw(std::uint32_t{48}) + packed, {"damaged"});
  expect_bad(replaced(header, "COUNT 1 1 1", "COUNT 1 1 1") + raw(size) + raw(std::uint32_t{48}) +
                 std::string(packed.size(), '\xff'),
             {"damaged"});
  // 2^27 points of 12 bytes in 5 bytes: refused before the memory is asked for
  const std::string bomb = pcd_header(1 << 27, "binary_compressed") + raw(std::uint32_t{5}) +
                           raw(std::uint32_t{12u << 27});
  expect_bad(bomb + std::string("\x00\x00\xe0\xff\x00", 5), {"damaged"});
}

}  // namespace
}  // namespace gpureg::io
