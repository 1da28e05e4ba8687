// SPDX-License-Identifier: BSD-3-Clause
// Files as other programs write them: each is read, or refused with the sentence that a user needs.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "gpureg/mesh.hpp"
#include "io/seed_files.hpp"
#include "support/cube.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

using namespace std::string_literals;
using test::expect_error;
using test::ply_header;
using test::raw;
using test::raw_points;
using test::replaced;
using test::TemporaryFolder;

struct Flavour {
  std::string name;  ///< of the file
  std::string content;
  std::size_t points;       ///< 0: refused
  std::string phrase = {};  ///< of the error, or of the note
  std::string of = {};      ///< the program that writes such files
  bool with_normals = false;
};

std::string rows(int count, const std::string& separator, const std::string& behind = "",
                 const std::string& line_end = "\n") {
  std::string text;
  for (int k = 0; k < count; ++k)
    text += std::to_string(k) + separator + std::to_string(k) + ".25" + separator + "-" +
            std::to_string(k) + behind + line_end;
  return text;
}

std::string pcd(const std::string& fields, const std::string& sizes, const std::string& types,
                const std::string& counts, int points, const std::string& data) {
  const std::string n = std::to_string(points);
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " + sizes + "\nTYPE " + types +
         "\nCOUNT " + counts + "\nWIDTH " + n + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n +
         "\nDATA " + data + "\n";
}

std::string with_crlf(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '\n' ? "\r\n" : std::string(1, c);
  return out;
}

/// Each row of binary data with these bytes behind.
std::string behind_rows(const std::string& data, std::size_t row, const std::string& bytes) {
  std::string out;
  for (std::size_t at = 0; at < data.size(); at += row) out += data.substr(at, row) + bytes;
  return out;
}

std::string properties(const std::string& type, std::initializer_list<const char*> names) {
  std::string text;
  for (const char* name : names) text += "property " + type + " " + name + "\n";
  return text;
}

std::string splats(int count) {
  std::string header = ply_header("binary_little_endian", count, "float", true);
  for (int k = 0; k < 56; ++k) header += "property float f_" + std::to_string(k) + "\n";
  return header + "end_header\n" +
         behind_rows(raw_points<float>(count, false, true), 24, std::string(56 * 4, '\1'));
}

std::string ptx_header(int columns, int rows_of_column, const std::string& position) {
  return std::to_string(columns) + "\n" + std::to_string(rows_of_column) + "\n" + position +
         "\n1 0 0\n0 1 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n" + position + " 1\n";
}

std::string ptx(const std::string& position) {
  return ptx_header(3, 2, position) +
         "0 0 0 0.5 0 0 0\n1 2 3 0.5 10 20 30\n4 5 6 0.5 1 1 1\n0 0 0 0.5 0 0 0\n"
         "7 8 9 0.5 1 1 1\n1 1 1 0.5 1 1 1\n";
}

std::vector<Flavour> pcd_flavours() {
  return {
      {"a.pcd",
       pcd("X Y Z Intensity", "8 8 8 2", "F F F U", "1 1 1 1", 5, "binary") +
           behind_rows(raw_points<double>(5, false, false), 24, "\1\2"),
       5, "", "PDAL"},
      {"b.pcd",
       pcd("x y z", "4 4 4", "F F F", "1 1 1", 4, "ascii") +
           "1 2 3\n-1.#IND -1.#IND -1.#IND\n1.#QNAN 1.#QNAN 1.#QNAN\n1.#INF -1.#INF 0\n",
       4, "", "PCL on Windows"},
      {"c.pcd",
       pcd("x y z", "4 4 4", "F F F", "1 1 1", 3, "ascii") +
           "nan(ind) -nan(ind) -nan\nInfinity -inf INF\n1 2 3\n",
       3, "", "PCL with newer Visual C++"},
      {"d.pcd",
       pcd("x y z _ histogram", "4 4 4 1 4", "F F F U F", "1 1 1 4 3", 4, "binary") +
           behind_rows(raw_points<float>(4, false, false), 12, std::string(16, '\0')),
       4, "", "PCL with padding and histograms"},
      {"e.pcd", pcd("x y z", "4 4 4", "F F F", "1 1 1", 3, "ascii") + rows(5, " "), 3,
       "2 lines were left out", "rows after the end"},
      {"f.pcd",
       "FIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nWIDTH 3\nHEIGHT 1\nDATA ascii\n" +
           rows(3, " ", " 0.5"),
       3, "", "old header without VERSION, COUNT, POINTS"},
      {"g.pcd", with_crlf(pcd("x y z", "4 4 4", "F F F", "1 1 1", 3, "ascii") + rows(3, " ")), 3,
       "", "Windows line ends"},
      {"h.pcd", pcd("a b z", "4 4 4", "F F F", "1 1 1", 1, "ascii") + "1 2 3\n", 0,
       "no coordinate x, only 'a', 'b', 'z'", "no coordinates"},
      {"i.pcd", pcd("x y z", "4 4 4", "F F F", "1 1 1", 9, "binary") + "short", 0, "truncated",
       "cut"},
  };
}

std::vector<Flavour> ply_flavours() {
  const std::string text = ply_header("ascii", 4, "float", false);
  const std::string binary = ply_header("binary_little_endian", 4, "float", false);
  const std::string lists = "property uchar type\nproperty list uchar int view\n";
  return {
      {"a.ply", text + "property bool is_planar\nend_header\n" + rows(4, " ", " 1"), 4, "",
       "bool property"},
      {"b.ply",
       binary + lists + "end_header\n" +
           behind_rows(raw_points<float>(4, false, false), 12, "\1\2"s + raw(1) + raw(2)),
       4, "", "list of a vertex, binary"},
      {"c.ply", text + lists + "end_header\n" + rows(2, " ", " 7 2 5 6") + rows(2, " ", " 7 0"), 4,
       "", "list of a vertex, text"},
      {"d.ply", text + lists + "end_header\n" + rows(4, " ", " 7 3 5 6"), 0,
       "fewer than its lists announce", "list that lies"},
      {"e.ply",
       text + "element face 0\nproperty list uchar int vertex_indices\nend_header\n" + rows(5, " "),
       4, "1 line was left out", "rows after the end"},
      {"f.ply",
       "ply\nformat binary_little_endian 1.0\ncomment Created by Open3D\nelement vertex 4\n" +
           properties("double", {"x", "y", "z", "nx", "ny", "nz"}) +
           properties("uchar", {"red", "green", "blue"}) + "end_header\n" +
           behind_rows(raw_points<double>(4, false, true), 48, "\1\2\3"),
       4, "", "Open3D", true},
      {"g.ply",
       "ply\nformat binary_little_endian 1.0\ncomment Created by CloudCompare\nobj_info Generated\n"
       "element vertex 4\n" +
           properties("float", {"x", "y", "z", "scalar_Intensity", "scalar_GpsTime"}) +
           "end_header\n" + behind_rows(raw_points<float>(4, false, false), 12, std::string(8, 0)),
       4, "", "CloudCompare"},
      {"h.ply",
       "ply\nformat ascii 1.0\nelement camera 1\n" + properties("float", {"view_px", "view_py"}) +
           "element vertex 4\n" + properties("float", {"x", "y", "z", "quality"}) +
           "property uint flags\nend_header\n0 0\n" + rows(4, " ", " 0.5 0"),
       4, "", "MeshLab, vertices not first"},
      {"i.ply",
       ply_header("binary_big_endian", 4, "double", false) + "end_header\n" +
           raw_points<double>(4, true, false),
       4, "", "big endian"},
      {"j.ply", splats(4), 4, "", "Gaussian splats", true},
      {"k.ply",
       "ply\nformat binary_little_endian 1.0\nelement vertex 2\n" +
           properties("uint", {"packed_position", "packed_color"}) + "end_header\n" +
           std::string(16, '\1'),
       0, "no coordinate x, only 'packed_position'", "compressed splats"},
      {"l.ply", replaced(text, "float x", "float X") + "end_header\n" + rows(4, " "), 4, "",
       "upper case"},
      {"m.ply", with_crlf(text + "end_header\n" + rows(4, " ")), 4, "", "Windows line ends"},
      {"n.ply", "\xEF\xBB\xBF" + text + "end_header\n" + rows(4, " "), 4, "", "UTF-8 mark"},
      {"o.ply", "", 0, "the file is empty", "empty"},
  };
}

std::vector<Flavour> text_flavours() {
  return {
      {"a.xyz", rows(5, " "), 5, "", "any"},
      {"b.txt", "# x y z\n\n" + rows(5, "\t", "\t0.5"), 5, "", "tabs, a comment"},
      {"c.csv", "x,y,z\n" + rows(5, ","), 5, "", "pandas"},
      {"d.csv", ",x,y,z\n0,1,2,3\n1,4,5,6\n", 2, "", "pandas with its index"},
      {"e.csv", "timestamp,x,y,z,intensities,ring\n1,2,3,4,5,6\n2,3,4,5,6,7\n", 2, "",
       "ETH, libpointmatcher"},
      {"f.txt", "\"X\",\"Y\",\"Z\",\"Intensity\"\n" + rows(5, ",", ",7"), 5, "", "PDAL"},
      {"g.csv", "\"Intensity\",\"Points:0\",\"Points:1\",\"Points:2\"\n9,1,2,3\n9,4,5,6\n", 2, "",
       "ParaView"},
      {"h.csv", "Points_m_XYZ:0,Points_m_XYZ:1,Points_m_XYZ:2,laser_id\n" + rows(5, ",", ",3"), 5,
       "", "VeloView"},
      {"i.csv", "\xEF\xBB\xBFsep=;\r\nX [m];Y [m];Z [m]\r\n" + rows(5, ";", "", "\r\n"), 5, "",
       "Excel"},
      {"j.csv", "name;x;y;z\na;1;2;3\nb;4;5;6\n", 2, "", "semicolons, names first"},
      {"k.asc", "//X Y Z R G B Nx Ny Nz\n3\n" + rows(3, " ", " 1 2 3 0 0 1"), 3, "", "CloudCompare",
       true},
      {"l.asc", rows(5, ", "), 5, "", "commas and blanks"},
      {"m.pts", "5\n" + rows(5, " ", " -120 10 20 30"), 5, "", "Leica PTS"},
      {"n.pts", rows(5, " ", " -120 10 20 30"), 5, "", "PTS without a count"},
      {"o.pts", "2\n" + rows(2, " ", " 1") + "3\n" + rows(3, " ", " 1"), 5, "", "PTS, two clouds"},
      {"p.pts", "9\n" + rows(5, " "), 0, "truncated: 9 points", "PTS, cut"},
      {"q.pts", "3\n" + rows(5, " "), 3, "2 rows after the announced 3", "PTS, too many"},
      {"r.xyzn", rows(5, " ", " 0 0 1"), 5, "", "Open3D, MeshLab", true},
      {"s.csv", "x,y,z,nx,ny,nz\n" + rows(5, ",", ",0,0,1"), 5, "", "named normals", true},
      {"t.csv", "x,y,z\n1,,3\n4,5,6\n", 2, "", "empty cells"},
      {"u", rows(5, " "), 5, "", "no extension"},
      {"v.csv", "x,y,ranges\n1,2,3\n4,5,6\n", 2, "no column z", "2-D scan"},
      {"w.txt", with_crlf("% x y z\n" + rows(5, "  ", " ")), 5, "", "Windows, MATLAB's comments"},
      {"x.txt", "1,5 2,5 3,5\n", 0, ":1: '1,5 2,5 3,5' has decimal commas", "decimal commas"},
      {"I.txt", "\"X\",\"Y\",\"Z\"\n" + rows(5, " "), 5, "",
       "names and numbers separated differently"},
      {"y.csv", "x;y;z\n1,5;2,5;3,5\n", 0, ":2: '1,5;2,5;3,5' has decimal commas",
       "decimal commas, Excel"},
      {"z.csv", "a,b,c\n1,2,3\n", 0, "names with x, y and z among them; found 'a', 'b', 'c'",
       "other columns"},
      {"A.txt", "1 2\n3 4\n", 0, ":1: a row of 2 numbers, expected x y z", "two columns"},
      {"B.xyz", "1 2 3\n4 five 6\n", 0, ":2: y is 'five', expected a number", "a word"},
      {"C.xyz", "1 2 3\n4 5\n", 0, ":2: point 2 has 2 values", "a short row"},
      {"D.xyz", "2\nwater\nO 0 0 0\nH 1 0 0\n", 0, ":2: expected a row of x y z", "a molecule"},
      {"E.csv", "\xFF\xFEx\0,\0y\0,\0z\0\n\0001\0,\0002\0,\0003\0\n\0"s, 0, "UTF-16", "UTF-16"},
      {"F.xyz", "\0\1\2\3\4\5\6\7"s, 0, "neither a PLY nor a PCD", "binary"},
      {"G.txt", "500000.25 5400000.5 1\n500001.25 5400001.5 2\n", 2, "", "map coordinates"},
      {"J.txt", "1 0 0 5\n0 0.6 0.8 6\n0 -0.8 0.6 7\n0 0 0 1\n", 0, "a list of poses (4 x 4",
       "a matrix"},
      {"K.log", "0 1 9\n1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n", 0, "a list of poses (4 x 4",
       "Redwood's log"},
      {"L.txt", "# timestamp tx ty tz qx qy qz qw\n1.5 1 2 3 0 0 0.6 0.8\n2.5 1 2 3 0 0 0 1\n", 0,
       "a list of poses (times, positions and quaternions)", "TUM"},
      {"M.txt", "1 0 0 5 0 1 0 6 0 0 1 7\n1 0 0 6 0 1 0 6 0 0 1 7\n", 0,
       "a list of poses (a matrix a line)", "KITTI's poses"},
      {"H.csv", "x,y,z\n", 0, "no row of numbers", "names only"},
  };
}

std::vector<Flavour> other_flavours() {
  const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
  std::string kitti;
  for (int k = 0; k < 3; ++k) kitti += raw_points<float>(1, false, false) + raw(0.5f);
  return {
      {"a.ptx", ptx("1 2 3"), 4, "", "Leica PTX"},
      {"b.ptx", ptx("1 2 3") + ptx("4 5 6"), 0, "it holds 2 scans: name one of them",
       "PTX of two scans"},
      {"c.ptx", ptx_header(3, 2, "0 0 0") + "1 2 3 0.5\n", 0, "truncated: a scan announces 6",
       "PTX, cut"},
      {"d.ptx", replaced(ptx("1 2 3"), "0 1 0\n0 0 1", "0 1\n0 0 1"), 0, "neither", "PTX, damaged"},
      {"e.obj", square, 4, "", "OBJ, vertices only"},
      {"f.obj", "# MeshLab\nvn 0 0 1\nv 0 0 0 1 1 1\nvn 0 0 1\nv 1 0 0 1 1 1\n", 2, "",
       "MeshLab, with normals and colours", true},
      {"g.obj", square + "f 1 2 3 4\n", 0, "a mesh, which read_mesh reads", "OBJ with faces"},
      {"h.off", "OFF\n# points\n3 0 0\n" + rows(3, " "), 3, "", "OFF"},
      {"i.off", "COFF\n3 0 0\n" + rows(3, " ", " 255 0 0 255"), 3, "", "COFF, MeshLab"},
      {"j.off", "NOFF\n3 0 0\n" + rows(3, " ", " 0 0 1"), 3, "", "NOFF", true},
      {"k.off", "OFF3 0 0\n" + rows(3, " "), 3, "", "ModelNet, counts in the first line"},
      {"l.off", "OFF\n3 1 0\n" + rows(3, " ") + "3 0 1 2\n", 0, "a mesh, which read_mesh reads",
       "OFF with faces"},
      {"m.off", "OFF\n9 0 0\n" + rows(3, " "), 0, "truncated", "OFF, cut"},
      {"n.off", "OFF BINARY\n1 0 0\n", 0, "binary OFF", "binary OFF"},
      {"o.bin", kitti, 3, "", "KITTI"},
      {"p.bin", kitti + "x", 0, "49 bytes are no scan of KITTI", "KITTI, cut"},
  };
}

std::vector<Flavour> foreign_flavours() {
  return {
      {"a.ply", "<!DOCTYPE html>\n<html>", 0, "a web page: the download failed", "download"},
      {"b.pcd", "\n  <html lang=\"en\">", 0, "a web page: the download failed", "download"},
      {"c.bin", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", 0,
       "run `git lfs pull`", "Git LFS"},
      {"d.ply", "PK\3\4rest", 0, "compressed: unpack it first", "ZIP"},
      {"e.ply.gz", "\x1F\x8B\x08\0rest"s, 0, "compressed: unpack it first", "gzip"},
      {"f.7z", "7z\xBC\xAFrest", 0, "compressed: unpack it first", "7-Zip"},
      {"g.png", "\x89PNG\r\n\x1A\n", 0, "gpureg.from_depth_image", "depth image"},
      {"h.jpg", "\xFF\xD8\xFF\xE0", 0, "an image", "photo"},
      {"i.bag", "#ROSBAG V2.0\n", 0, "extract its clouds first", "ROS 1"},
      {"j.mcap", "\x89MCAP0\r\n", 0, "extract its clouds first", "ROS 2"},
      {"k.db3", "SQLite format 3\0"s, 0, "extract its clouds first", "ROS 2"},
      {"l.pcap", "\xD4\xC3\xB2\xA1"s, 0, "export its frames", "LiDAR packets"},
      {"m.glb", "glTF\2\0\0\0"s, 0, "convert it to PLY, STL or OBJ", "glTF"},
      {"n.gltf", "{}", 0, "convert it to PLY, STL or OBJ", "glTF"},
      {"o.fbx", "Kaydara FBX Binary", 0, "convert it to PLY, STL or OBJ", "FBX"},
      {"p.stp", "ISO-10303-21;\n", 0, "export it as STL or OBJ", "STEP"},
      {"q.npy", "\x93NUMPY\1", 0, "load them in Python", "NumPy"},
      {"r.h5", "\x89HDF\r\n\x1A\n", 0, "load them in Python", "HDF5"},
      {"s.las", "LASF" + std::string(400, '\0'), 0, "pip install 'gpureg[formats]'", "LAS"},
      {"t.copc.laz", "LASF" + std::string(400, '\0'), 0, "pip install 'gpureg[formats]'", "COPC"},
      {"u.e57", "ASTM-E57" + std::string(40, '\0'), 0, "pip install 'gpureg[formats]'", "E57"},
      {"v.rcp", "project", 0, "export it as E57, PTX or PLY", "ReCap"},
      {"w.splat", std::string(64, '\1'), 0, "export them as PLY", "splats"},
      {"x.ply", std::string(64, '\1'), 0, "neither a PLY nor a PCD", "something else"},
  };
}

void check(const std::vector<Flavour>& flavours) {
  const TemporaryFolder folder;
  for (const Flavour& flavour : flavours) {
    SCOPED_TRACE(flavour.name + ", " + flavour.of);
    const std::string path = folder.write(flavour.name, flavour.content);
    if (flavour.points == 0) {
      expect_error<IoError>([&] { read_point_cloud(path); }, {path, flavour.phrase});
      continue;
    }
    std::string note;
    PointCloud cloud;
    ASSERT_NO_THROW(cloud = read_point_cloud(path, 0, &note));
    EXPECT_EQ(cloud.points.size(), flavour.points);
    EXPECT_EQ(cloud.normals.size(), flavour.with_normals ? flavour.points : 0);
    if (flavour.phrase.empty())
      EXPECT_EQ(note, "");
    else
      EXPECT_NE(note.find(flavour.phrase), std::string::npos) << note;
    // The last point is in the right columns.
    if (flavour.content.find(rows(2, " ")) != std::string::npos)
      EXPECT_FLOAT_EQ(cloud.points[1].y(), 1.25f);
  }
}

TEST(Flavours, Pcd) { check(pcd_flavours()); }
TEST(Flavours, Ply) { check(ply_flavours()); }
TEST(Flavours, Text) { check(text_flavours()); }
TEST(Flavours, PtxObjOffKitti) { check(other_flavours()); }
TEST(Flavours, WhatIsNotRead) { check(foreign_flavours()); }

Eigen::Vector3f first_point(const std::string& name, const std::string& content) {
  const TemporaryFolder folder;
  return read_point_cloud(folder.write(name, content)).points.at(0);
}

TEST(Flavours, ColumnsByTheirNames) {
  const Eigen::Vector3f expected(1, 2, 3);
  EXPECT_EQ(first_point("a.csv", "z,y,x\n3,2,1\n"), expected);
  EXPECT_EQ(first_point("a.csv", "t;Z;i;Y;X\n9;3;9;2;1\n"), expected);
  EXPECT_EQ(first_point("a.csv", "i,Points:0,Points:1,Points:2\n9,1,2,3\n"), expected);
  EXPECT_EQ(first_point("a.txt", "#t x y z\n9 1 2 3\n"), expected);
  EXPECT_EQ(first_point("a.txt", "x [m]\ty [m]\tz [m]\n1\t2\t3\n"), expected);
}

TEST(Flavours, WhatIsNoNumberOnWindows) {
  const TemporaryFolder folder;
  const PointCloud cloud = read_point_cloud(
      folder.write("a.xyz", "1 2 3\n-1.#IND 1.#QNAN nan(ind)\n1.#INF -1.#INF 0\n"));
  ASSERT_EQ(cloud.points.size(), 3u);
  for (int axis = 0; axis < 3; ++axis) EXPECT_TRUE(std::isnan(cloud.points[1][axis]));
  EXPECT_GT(cloud.points[2].x(), 1e30f);
  EXPECT_LT(cloud.points[2].y(), -1e30f);
}

TEST(Flavours, MapCoordinatesInTextKeepTheirDigits) {
  const TemporaryFolder folder;
  const PointCloud cloud =
      read_point_cloud(folder.write("a.txt", "500000.125 5400000.25 1\n500001.125 5400001.25 2\n"));
  EXPECT_FALSE(cloud.origin.isZero(0));
  EXPECT_DOUBLE_EQ(cloud.origin.y() + static_cast<double>(cloud.points[0].y()), 5400000.25);
}

TEST(Ptx, ScansWithTheirPosesAndViewpoints) {
  const TemporaryFolder folder;
  const std::string path = folder.write("a.ptx", ptx("1 2 3") + ptx("4 5 6"));
  EXPECT_EQ(count_scans(path), 2u);
  const std::vector<StoredScan> scans = scans_in(path);
  ASSERT_EQ(scans.size(), 2u);
  EXPECT_EQ(scans[1].points, 6u);
  ASSERT_TRUE(scans[1].file_from_scan);
  // The file has the transposed matrix: rows are multiplied from the left.
  EXPECT_TRUE((*scans[1].file_from_scan * Eigen::Vector4d(1, 0, 0, 1))
                  .isApprox(Eigen::Vector4d(4, 6, 6, 1)));
  for (const PointCloud& cloud :
       {read_point_cloud(path, 2), read_point_cloud(path + "#2"), read_point_cloud(path, 1)}) {
    ASSERT_EQ(cloud.points.size(), 4u);
    EXPECT_EQ(cloud.points[3], Eigen::Vector3f(1, 1, 1));
    ASSERT_EQ(cloud.viewpoints.size(), 1u);
    EXPECT_TRUE(cloud.viewpoints[0].isZero(0));
  }
  expect_error<IoError>([&] { read_point_cloud(path); }, {"name one of them", "a.ptx#1' to '#2'"});
  expect_error<IoError>([&] { read_point_cloud(path + "#3"); }, {"there is no scan 3"});
  const std::string one = folder.write("one.ptx", ptx("1 2 3"));
  EXPECT_EQ(read_point_cloud(one + "#1").points.size(), 4u);
  expect_error<IoError>([&] { read_point_cloud(one, 2); }, {"there is no scan 2, it holds 1"});
  // A file of that very name is itself.
  EXPECT_EQ(read_point_cloud(folder.write("b#2", rows(3, " "))).points.size(), 3u);
  EXPECT_EQ(count_scans(folder.write("c.xyz", rows(3, " "))), 1u);
}

TEST(Ptx, PointsInTheFrameOfTheProject) {
  const TemporaryFolder folder;
  const PointCloud cloud = read_point_cloud(
      folder.write("a.ptx",
                   "1\n2\n10 20 30\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
                   "0 0 0 1\n11 20 30 0.5\n5 25 33 0.5\n"));
  EXPECT_EQ(cloud.viewpoints.at(0), Eigen::Vector3f(10, 20, 30));
  // Moved into a map by a program that forgot the scanner.
  const PointCloud moved = read_point_cloud(
      folder.write("b.ptx",
                   "1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
                   "5000 5000 3 0.5\n5010 5010 4 0.5\n"));
  EXPECT_TRUE(moved.viewpoints.empty());
}

/// An E57 file with this XML and nothing else, in pages of 1024 bytes.
std::string e57(const std::string& xml) {
  std::string content;
  const std::size_t pages = (48 + xml.size()) / 1020 + 1;
  const auto number = [](std::uint64_t value) { return raw(value); };
  content = "ASTM-E57" + raw(std::uint32_t{1}) + raw(std::uint32_t{0}) + number(1024 * pages) +
            number(48) + number(xml.size()) + number(1024) + xml;
  std::string out;
  for (std::size_t at = 0; at < content.size(); at += 1020) {
    std::string page = content.substr(at, 1020);
    page.resize(1020, '\0');
    out += page + "CRC!";
  }
  return out;
}

std::string e57_xml(int scans) {
  std::string xml =
      "<?xml version=\"1.0\"?>\n<e57Root type=\"Structure\"><!-- <data3D> -->\n"
      "<data3D type=\"Vector\" allowHeterogeneousChildren=\"1\">\n";
  for (int k = 1; k <= scans; ++k)
    xml += "<vectorChild type=\"Structure\"><name type=\"String\"><![CDATA[Station <" +
           std::to_string(k) +
           ">]]></name>\n<pose type=\"Structure\"><rotation type=\"Structure\"><w type=\"Float\">1"
           "</w><x type=\"Float\"/></rotation><translation type=\"Structure\"><x type=\"Float\">" +
           std::to_string(k) +
           "</x></translation></pose><points type=\"CompressedVector\" fileOffset=\"48\" "
           "recordCount=\"123\"><prototype type=\"Structure\"><name type=\"Float\"/></prototype>"
           "</points></vectorChild>\n";
  return xml + "</data3D><images2D type=\"Vector\"/></e57Root>\n";
}

TEST(E57, TheListOfScans) {
  const TemporaryFolder folder;
  const std::string path = folder.write("a.e57", e57(e57_xml(9)));  // of several pages
  const std::vector<StoredScan> scans = scans_in(path);
  ASSERT_EQ(scans.size(), 9u);
  EXPECT_EQ(count_scans(path), 9u);
  EXPECT_EQ(scans[8].name, "Station <9>");
  EXPECT_EQ(scans[8].points, 123u);
  ASSERT_TRUE(scans[8].file_from_scan);
  EXPECT_EQ((scans[8].file_from_scan->topRightCorner<3, 1>()), Eigen::Vector3d(9, 0, 0));
  expect_error<IoError>([&] { read_point_cloud(path); }, {"gpureg[formats]"});
}

TEST(E57, DamagedListsOfScans) {
  const TemporaryFolder folder;
  const std::string whole = e57(e57_xml(9));
  const auto damaged = [&](std::string content, std::initializer_list<std::string> fragments) {
    SCOPED_TRACE(content.size());
    const std::string path = folder.write("a.e57", content);
    expect_error<IoError>([&] { scans_in(path); }, fragments);
  };
  damaged(whole.substr(0, 40), {"a.e57", "header"});
  damaged(whole.substr(0, 2048), {"a.e57", "truncated"});
  damaged(std::string(whole).replace(32, 8, std::string(8, '\xFF')), {"a.e57", "truncated"});
  damaged(std::string(whole).replace(40, 8, std::string(8, '\0')), {"a.e57", "damaged"});
  damaged(e57("<e57Root><data3D></e57Root>"), {"a.e57", "wrong tag"});
}

TEST(Off, Meshes) {
  const TemporaryFolder folder;
  std::string vertices, faces;
  for (const Eigen::Vector3d& v : test::cube_vertices())
    vertices +=
        std::to_string(v.x()) + " " + std::to_string(v.y()) + " " + std::to_string(v.z()) + "\n";
  for (const auto& f : test::cube_faces())
    faces += "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) +
             " 255 0 0\n";
  for (const char* start :
       {"OFF\n8 12 0\n", "OFF 8 12 0\n", "OFF8 12 0\n", "# c\nCOFF\n\n8 12\n"}) {
    const std::string path = folder.write("a.off", start + vertices + "\n" + faces);
    EXPECT_TRUE(is_mesh(path));
    const SurfaceMesh mesh = read_mesh(path);
    EXPECT_TRUE(mesh.closed());
    EXPECT_DOUBLE_EQ(mesh.area(), 6);
  }
  const auto refused = [&](const std::string& content,
                           std::initializer_list<std::string> fragments) {
    const std::string path = folder.write("b.off", content);
    expect_error<IoError>([&] { read_mesh(path); }, fragments);
  };
  refused("OFF\n8 13 0\n" + vertices + faces, {"b.off", "truncated", "13 faces"});
  refused("OFF\n8 12 0\n" + vertices + "3 0 1\n" + faces, {":11:", "expected a face"});
  refused("OFF\n8 1 0\n" + vertices + "3 0 1 8\n", {"vertex 8", "there are 8"});
  refused("OFF\n8 999999999999 0\n" + vertices, {"truncated"});
  refused("OFF\n999999999 1 0\n" + vertices, {"truncated"});
}

TEST(Flavours, MeshesOfOtherFormats) {
  const TemporaryFolder folder;
  const std::string page = folder.write("a.stl", "<!DOCTYPE html>" + std::string(200, ' '));
  expect_error<IoError>([&] { read_mesh(page); }, {"web page"});
  const std::string model = folder.write("a.glb", "glTF" + std::string(200, ' '));
  expect_error<IoError>([&] { read_mesh(model); }, {"convert it"});
}

}  // namespace
}  // namespace gpureg::io
