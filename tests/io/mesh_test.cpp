// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/mesh.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "gpureg/error.hpp"
#include "gpureg/io.hpp"
#include "support/cube.hpp"
#include "support/expect_error.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg::io {
namespace {

using test::cube_faces;
using test::cube_vertices;
using test::expect_error;
using test::TemporaryFolder;
using test::Triangles;

const Eigen::Vector3f kMiddle(0.5f, 0.5f, 0.5f);

/// Share of the points whose normal points away from the middle of the cube.
double outwards(const PointCloud& cloud) {
  std::size_t count = 0;
  for (std::size_t k = 0; k < cloud.points.size(); ++k)
    count += cloud.normals[k].dot(cloud.points[k] - kMiddle) > 0.499f;
  return static_cast<double>(count) / static_cast<double>(cloud.points.size());
}

TEST(Mesh, SamplesLieOnTheFacesUniformlyByArea) {
  const SurfaceMesh mesh = make_mesh(cube_vertices(), cube_faces());
  EXPECT_TRUE(mesh.closed());
  EXPECT_EQ(mesh.notes(), "");
  EXPECT_DOUBLE_EQ(mesh.area(), 6);
  const PointCloud cloud = sample_mesh(mesh);
  ASSERT_EQ(cloud.points.size(), 20000u);
  EXPECT_EQ(outwards(cloud), 1);
  std::array<int, 6> on_side{};
  for (std::size_t k = 0; k < cloud.points.size(); ++k) {
    Eigen::Index axis = 0;
    cloud.normals[k].cwiseAbs().maxCoeff(&axis);
    EXPECT_EQ(cloud.points[k][axis], cloud.normals[k][axis] > 0 ? 1.f : 0.f);
    ++on_side[static_cast<std::size_t>(2 * axis + (cloud.normals[k][axis] > 0))];
  }
  for (const int count : on_side) EXPECT_NEAR(count, 20000 / 6, 2);  // stratified
  EXPECT_EQ(sample_mesh(mesh).points, cloud.points);
}

TEST(Mesh, SpacingDecidesTheNumberOfSamples) {
  const SurfaceMesh mesh = make_mesh(cube_vertices(), cube_faces());
  EXPECT_EQ(sample_mesh(mesh, 0.01).points.size(), 60000u);
  EXPECT_EQ(sample_mesh(mesh, 1).points.size(), 20000u);
  EXPECT_EQ(sample_mesh(mesh, 1e-5).points.size(), 2000000u);
  expect_error<InvalidArgument>([&] { sample_mesh(mesh, -1); }, {"spacing is -1"});
  expect_error<InvalidArgument>(
      [&] { sample_mesh(mesh, std::numeric_limits<double>::quiet_NaN()); }, {"spacing is nan"});
  expect_error<InvalidArgument>([] { sample_mesh(SurfaceMesh{}); }, {"mesh.faces", "empty"});
}

/// A depth image with faces: a wall at z = 3 and a box before it.
SurfaceMesh depth_image() {
  constexpr std::uint32_t kSide = 120;
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> faces;
  const auto near = [](std::uint32_t u, std::uint32_t v) {
    return u > 30 && u < 70 && v > 40 && v < 90;
  };
  for (std::uint32_t v = 0; v < kSide; ++v)
    for (std::uint32_t u = 0; u < kSide; ++u) {
      const double depth = near(u, v) ? 2 : 3;
      vertices.push_back(depth * Eigen::Vector3d((u - 60.0) / 100, (v - 60.0) / 100, 1));
      if (u == 0 || v == 0 || near(u, v) != near(u - 1, v) || near(u, v) != near(u, v - 1) ||
          near(u, v) != near(u - 1, v - 1))
        continue;
      const std::uint32_t at = v * kSide + u, left = at - 1, up = at - kSide;
      faces.push_back({at, up, left});
      faces.push_back({left, up, up - 1});
    }
  return make_mesh(std::move(vertices), std::move(faces));
}

TEST(Mesh, ADepthImageWithFacesIsAScanAndNoModel) {
  const PointCloud scan = sample_mesh(depth_image());
  EXPECT_FALSE(scan.model);
  ASSERT_EQ(scan.viewpoints.size(), 1u);
  EXPECT_EQ(scan.viewpoints[0], Eigen::Vector3f(0, 0, 0));
  // From behind, or from the side, it is an open model.
  const auto moved = [](const Eigen::Vector3d& by) {
    SurfaceMesh mesh = depth_image();
    for (Eigen::Vector3d& p : mesh.vertices) p += by;
    return sample_mesh(mesh);
  };
  for (const Eigen::Vector3d& by : {Eigen::Vector3d(0, 0, -5), Eigen::Vector3d(4, 0, -2.5)}) {
    EXPECT_TRUE(moved(by).model) << by.transpose();
    EXPECT_TRUE(moved(by).viewpoints.empty());
  }
}

TEST(Mesh, AnOpenModelIsAModelAlsoWhereItsOriginIsOutside) {
  // A box without its lid, and a cabinet of shelves whose boards hide each other.
  auto box = cube_faces();
  box.resize(box.size() - 2);
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> faces;
  for (int k = 0; k < 5; ++k) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (const double x : {-1.0, 1.0})
      for (const double y : {-1.0, 1.0}) vertices.emplace_back(x, y, 2.0 + k);
    faces.push_back({first, first + 1, first + 2});
    faces.push_back({first + 1, first + 3, first + 2});
  }
  for (SurfaceMesh mesh : {make_mesh(cube_vertices(), box), make_mesh(vertices, faces)})
    for (const double away : {0.0, 5.0}) {
      for (Eigen::Vector3d& p : mesh.vertices) p.z() += away;
      EXPECT_TRUE(sample_mesh(mesh).model);
    }
}

TEST(Mesh, FlippedFacesAreTurned) {
  Triangles faces = cube_faces();
  std::swap(faces[3][0], faces[3][1]);
  const SurfaceMesh one = make_mesh(cube_vertices(), faces);
  EXPECT_EQ(one.flipped_faces, 1u);
  EXPECT_EQ(one.notes(), "1 faces pointed the wrong way and were turned");
  EXPECT_EQ(outwards(sample_mesh(one)), 1);
  faces = cube_faces();
  for (auto& face : faces) std::swap(face[0], face[1]);
  const SurfaceMesh all = make_mesh(cube_vertices(), faces);
  EXPECT_EQ(all.flipped_faces, 12u);
  EXPECT_EQ(outwards(sample_mesh(all)), 1);
}

TEST(Mesh, OpenAndNonManifoldSurfaces) {
  Triangles faces = cube_faces();
  faces.pop_back();
  const SurfaceMesh open = make_mesh(cube_vertices(), faces);
  EXPECT_FALSE(open.closed());
  EXPECT_EQ(open.open_edges, 3u);
  EXPECT_EQ(open.notes(), "");
  faces = cube_faces();
  faces.push_back({0, 1, 7});  // a third face at the edge 0-1
  const SurfaceMesh fin = make_mesh(cube_vertices(), faces);
  EXPECT_FALSE(fin.closed());
  EXPECT_EQ(fin.non_manifold_edges, 1u);
  EXPECT_NE(fin.notes().find("1 edges belong to more than two faces"), std::string::npos);
  EXPECT_EQ(sample_mesh(fin).points.size(), 20000u);
}

TEST(Mesh, FacesWithoutAreaAreDropped) {
  Triangles faces = cube_faces();
  faces.push_back({0, 0, 1});
  const SurfaceMesh mesh = make_mesh(cube_vertices(), faces);
  EXPECT_EQ(mesh.faces.size(), 12u);
  EXPECT_EQ(mesh.notes(), "1 faces without area were dropped");
  expect_error<InvalidArgument>([] { make_mesh(cube_vertices(), {{0, 0, 1}, {2, 2, 2}}); },
                                {"faces", "none of 2 has an area"});
  expect_error<InvalidArgument>([] { make_mesh(cube_vertices(), {}); }, {"none of 0"});
}

TEST(Mesh, WrongVerticesAreNamed) {
  auto vertices = cube_vertices();
  vertices[5].y() = std::numeric_limits<double>::quiet_NaN();
  expect_error<InvalidArgument>([&] { make_mesh(vertices, cube_faces()); },
                                {"vertices[5]", "nan", "finite"});
  vertices[5].y() = std::numeric_limits<double>::infinity();
  expect_error<InvalidArgument>([&] { make_mesh(vertices, cube_faces()); }, {"vertices[5]", "inf"});
  Triangles faces = cube_faces();
  faces[4][2] = 8;
  expect_error<InvalidArgument>([&] { make_mesh(cube_vertices(), faces); },
                                {"faces[4]", "vertex 8", "there are 8"});
}

TEST(MeshFile, IsToldByItsFaces) {
  const TemporaryFolder folder;
  EXPECT_TRUE(is_mesh(folder.write("a.ply", test::ply_text(cube_vertices(), cube_faces()))));
  EXPECT_FALSE(is_mesh(folder.write("b.ply", test::ply_text(cube_vertices(), {}))));
  EXPECT_FALSE(is_mesh(folder.write("c.pcd", "")));
  EXPECT_FALSE(is_mesh(folder / "none.ply"));
  EXPECT_TRUE(is_mesh(folder / "d.STL"));
  EXPECT_FALSE(is_mesh(folder / "none.obj"));
  EXPECT_FALSE(is_mesh(folder.write("e.obj", "v 1 2 3\n")));
  EXPECT_TRUE(is_mesh(folder.write("f.obj", test::obj_text(cube_vertices(), cube_faces()))));
  const std::string stl = folder.write("e.stl", test::stl_text(cube_vertices(), cube_faces()));
  expect_error<IoError>([&] { read_point_cloud(stl); }, {stl, "mesh", "read_mesh"});
}

TEST(MeshFile, StlObjAndPlyHoldTheSameSurface) {
  const TemporaryFolder folder;
  for (const std::string& path :
       {folder.write("cube.stl", test::stl_text(cube_vertices(), cube_faces())),
        folder.write("cube.obj", test::obj_text(cube_vertices(), cube_faces())),
        folder.write("cube.ply", test::ply_text(cube_vertices(), cube_faces()))}) {
    SCOPED_TRACE(path);
    const SurfaceMesh mesh = read_mesh(path);
    EXPECT_EQ(mesh.faces.size(), 12u);
    EXPECT_DOUBLE_EQ(mesh.area(), 6);
    EXPECT_TRUE(mesh.closed());
    EXPECT_EQ(mesh.notes(), "");
    EXPECT_EQ(outwards(sample_mesh(mesh)), 1);
  }
}

TEST(MeshFile, FlippedFacesOfAFileAreTurned) {
  const TemporaryFolder folder;
  Triangles faces = cube_faces();
  std::swap(faces[0][0], faces[0][1]);
  faces.push_back({0, 1, 7});
  for (const std::string& path : {folder.write("a.stl", test::stl_text(cube_vertices(), faces)),
                                  folder.write("a.obj", test::obj_text(cube_vertices(), faces)),
                                  folder.write("a.ply", test::ply_text(cube_vertices(), faces))}) {
    const SurfaceMesh mesh = read_mesh(path);
    EXPECT_NE(mesh.notes().find("1 faces pointed the wrong way"), std::string::npos) << path;
    EXPECT_NE(mesh.notes().find("1 edges belong to more"), std::string::npos) << path;
  }
}

TEST(MeshFile, PolygonsBecomeTriangles) {
  const TemporaryFolder folder;
  const std::string quad = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n";
  EXPECT_DOUBLE_EQ(read_mesh(folder.write("quad.obj", quad)).area(), 2);
}

TEST(MeshFile, WrongFilesAreNamed) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& name, const std::string& content,
                           std::initializer_list<std::string> fragments) {
    SCOPED_TRACE(name);
    const std::string path = folder.write(name, content);
    expect_error<IoError>([&] { read_mesh(path); }, {path});
    expect_error<IoError>([&] { read_mesh(path); }, fragments);
  };
  auto vertices = cube_vertices();
  vertices[3].z() = std::numeric_limits<double>::quiet_NaN();
  refused("nan.ply", test::ply_text(vertices, cube_faces()), {"nan", "finite"});
  refused("nan.stl", test::stl_text(vertices, cube_faces()), {"nan", "finite"});
  refused("no_faces.obj", test::obj_text(cube_vertices(), {}), {"face"});
  refused("no_faces.stl", "solid a\nendsolid a\n", {"face"});
  refused("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", {"none of 1 has an area"});
  refused("empty.stl", "", {"face"});
  const std::string whole = test::ply_text(cube_vertices(), cube_faces());
  refused("truncated.ply", whole.substr(0, whole.size() - 40), {"truncated", "face"});
  std::string binary(84 + 12 * 50, '\0');
  binary[80] = 12;
  refused("truncated.stl", binary.substr(0, binary.size() - 1), {"face"});
  expect_error<IoError>([&] { read_mesh(folder / "none.stl"); }, {"none.stl"});
}

}  // namespace
}  // namespace gpureg::io
