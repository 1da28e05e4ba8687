// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <ctime>
#include <sstream>

#include "gpureg/error.hpp"
#include "gpureg/mesh.hpp"
#include "io/seed_files.hpp"
#include "support/cube.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

using test::cube_faces;
using test::cube_vertices;
using test::expect_error;
using test::raw;
using test::TemporaryFolder;

void refused(const std::string& name, const std::string& content,
             std::initializer_list<std::string> fragments) {
  SCOPED_TRACE(name);
  const TemporaryFolder folder;
  const std::string path = folder.write(name, content);
  expect_error<IoError>([&] { read_mesh(path); }, {path});
  expect_error<IoError>([&] { read_mesh(path); }, fragments);
}

std::string ply_of(const std::string& faces, int count) {
  const std::string text = test::ply_text(cube_vertices(), {});
  return std::string(text).replace(text.find("face 0"), 6, "face " + std::to_string(count)) + faces;
}

TEST(MeshFile, FacesOfVerticesThatAreNotThere) {
  refused("a.ply", ply_of("3 0 1 99999999\n", 1), {"face 1", "vertex 99999999", "there are 8"});
  refused("a.ply", ply_of("3 0 1 2\n3 0 1 -2\n", 2), {"face 2", "-2"});
  refused("a.ply", ply_of("3 0 1 1.5\n", 1), {"face 1", "1.5"});
  refused("a.ply", ply_of("4 0 1 2\n", 1), {"fewer than its lists announce"});
  refused("a.ply", ply_of("0\n", 1), {"none of 0 has an area"});
  refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", {"vertex 4", "there are 3"});
  refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", {":4:", "'0'"});
  refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", {":4:", "'-4'"});
  refused("a.obj", "v 0 0 0\nv 1 0\n", {":2:", "v x y z"});
}

TEST(MeshFile, FacesOfFewerThanThreeCornersAreDropped) {
  const TemporaryFolder folder;
  const SurfaceMesh mesh = read_mesh(folder.write("a.ply", ply_of("0\n1 0\n2 0 1\n3 0 1 2\n", 4)));
  EXPECT_EQ(mesh.faces.size(), 1u);
  EXPECT_EQ(mesh.notes(), "3 faces without area were dropped");
}

TEST(MeshFile, PlyOfBothByteOrdersWithOtherProperties) {
  const TemporaryFolder folder;
  for (const bool big : {false, true}) {
    std::string ply = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                      "_endian 1.0\nelement face 12\nproperty uchar red\nproperty list uchar float "
                      "texcoord\nproperty list uchar uint vertex_index\nelement vertex 8\n"
                      "property double x\nproperty double y\nproperty double z\nend_header\n";
    for (const auto& face : cube_faces()) {
      ply += std::string("\xff\1") + raw(0.5f, big) + "\3";
      for (const std::uint32_t k : face) ply += raw(k, big);
    }
    for (const Eigen::Vector3d& v : cube_vertices())
      for (const double axis : v) ply += raw(axis, big);
    const SurfaceMesh mesh = read_mesh(folder.write("a.ply", ply));
    EXPECT_TRUE(mesh.closed());
    EXPECT_DOUBLE_EQ(mesh.area(), 6);
  }
}

std::string binary_stl(const std::string& comment) {
  const auto vertices = cube_vertices();
  std::string stl = comment + std::string(80 - comment.size(), ' ') + raw(std::uint32_t{12});
  for (const auto& face : cube_faces()) {
    stl += std::string(12, '\0');
    for (const std::uint32_t k : face)
      for (const double axis : vertices[k]) stl += raw(static_cast<float>(axis));
    stl += std::string(2, '\0');
  }
  return stl;
}

TEST(MeshFile, BinaryStl) {
  const TemporaryFolder folder;
  for (const char* comment : {"", "solid of a program that writes this word"}) {
    const SurfaceMesh mesh = read_mesh(folder.write("a.stl", binary_stl(comment)));
    EXPECT_TRUE(mesh.closed());
    EXPECT_DOUBLE_EQ(mesh.area(), 6);
  }
  const std::string whole = binary_stl("");
  refused("cut.stl", whole.substr(0, whole.size() - 1), {"truncated", "12 faces", "599 bytes"});
  refused("cut.stl", whole.substr(0, 83), {"neither a text nor a binary STL"});
  refused("text.stl", "solid\nfacet\nouter loop\nvertex 0 0\n", {":4:", "vertex x y z"});
  refused("text.stl", "solid\nfacet\nouter loop\nvertex 0 0 0\n", {"truncated", "face"});
}

TEST(MeshFile, ObjCornersWithTexturesNegativeNumbersAndContinuedLines) {
  const TemporaryFolder folder;
  const std::string obj =
      "# a square\r\nmtllib none.mtl\r\nv 0 0 0 1 # w\r\nv 2 0 0\r\nv 2 1 0\r\nv 0 1 0\r\n"
      "vt 0 0\r\nvn 0 0 1\r\nusemtl a\r\nf 1/1/1 -3//1 \\\r\n 3/1 4\r\n";
  const SurfaceMesh mesh = read_mesh(folder.write("a.obj", obj));
  EXPECT_EQ(mesh.faces.size(), 2u);
  EXPECT_DOUBLE_EQ(mesh.area(), 2);
}

// Nobody writes to the pipe: who opens it waits for ever.
TEST(MeshFile, FilesThatAnObjNamesAreNotOpened) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe.mtl").c_str(), 0600), 0);
  const std::string path =
      folder.write("a.obj", "mtllib pipe.mtl\n" + test::obj_text(cube_vertices(), cube_faces()));
  EXPECT_EQ(read_mesh(path).faces.size(), 12u);
}

/// A polygon of Wavefront OBJ.
std::string polygon(const std::vector<Eigen::Vector2d>& corners) {
  std::ostringstream text;
  text.precision(17);
  for (const Eigen::Vector2d& p : corners) text << "v 0 " << p.x() << ' ' << p.y() << '\n';
  text << 'f';
  for (std::size_t k = 1; k <= corners.size(); ++k) text << ' ' << k;
  return text.str() + "\n";
}

std::vector<Eigen::Vector2d> star(int corners, double inner) {
  std::vector<Eigen::Vector2d> out;
  for (int k = 0; k < corners; ++k) {
    const double at = 2 * M_PI * k / corners;
    out.push_back((k % 2 == 0 ? 1 : inner) * Eigen::Vector2d(std::cos(at), std::sin(at)));
  }
  return out;
}

double doubled_area(const std::vector<Eigen::Vector2d>& p) {
  double sum = 0;
  for (std::size_t k = 0; k < p.size(); ++k) {
    const Eigen::Vector2d &a = p[k], &b = p[(k + 1) % p.size()];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return std::abs(sum);
}

// Triangles that leave the polygon, or lie on each other, have a larger area than it.
TEST(MeshFile, PolygonsThatAreNotConvex) {
  const TemporaryFolder folder;
  const std::vector<Eigen::Vector2d> shapes[] = {
      {{0, 0}, {4, 0}, {4, 1}, {1, 1}, {1, 3}, {0, 3}},          // L
      {{0, 0}, {4, 3}, {0, 2}, {-4, 3}},                         // arrow
      {{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {0, 2}, {0, 1}},  // corners on straight sides
      star(10, 0.4),
      star(500, 0.5)};
  for (std::vector<Eigen::Vector2d> shape : shapes)
    for (const bool turned : {false, true}) {
      if (turned) std::reverse(shape.begin(), shape.end());
      const SurfaceMesh mesh = read_mesh(folder.write("a.obj", polygon(shape)));
      EXPECT_EQ(mesh.faces.size(), shape.size() - 2);
      EXPECT_EQ(mesh.flipped_faces, 0u);
      // The sum of 500 areas of about 1e-2, in double.
      EXPECT_NEAR(mesh.area(), doubled_area(shape) / 2, 1e-12);
    }
}

TEST(MeshFile, PolygonsOfManyCorners) {
  const std::clock_t begin = std::clock();
  const TemporaryFolder folder;
  const SurfaceMesh disc = read_mesh(folder.write("a.obj", polygon(star(300000, 1))));
  EXPECT_EQ(disc.faces.size(), 299998u);
  EXPECT_NEAR(disc.area(), M_PI, 1e-8);  // the polygon lacks 2/3 pi^3 / 300000^2 of the circle
  refused("a.obj", polygon(star(300000, 0.5)), {"face 1", "300000 corners", "500"});
  // It takes about a second; looking for ears of 300,000 corners takes minutes.
  EXPECT_LT(std::clock() - begin, 30 * CLOCKS_PER_SEC);
}

}  // namespace
}  // namespace gpureg::io
