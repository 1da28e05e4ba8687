// SPDX-License-Identifier: BSD-3-Clause
#include "data/rooms/building_file.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "data/rooms/building_texture.hpp"
#include "data/sensor/rgbd.hpp"
#include "gpureg/error.hpp"
#include "scene.hpp"
#include "support/expect_error.hpp"

namespace gpureg::test {
namespace {

using synthetic::generate;
using synthetic::GenerateOptions;
using synthetic::read_building;

#ifdef GPUREG_HAVE_ASSIMP

/// A room of 6 x 4 x 2.5 m, as text of Wavefront OBJ, in units of 1 / scale metres.
std::string room(double scale = 1, bool walls = true) {
  std::ostringstream text;
  for (int k = 0; k < 8; ++k)
    text << "v " << scale * (k & 1 ? 6 : 0) << ' ' << scale * (k & 2 ? 4 : 0) << ' '
         << scale * (k & 4 ? 2.5 : 0) << '\n';
  text << "f 1 2 4 3\nf 5 6 8 7\n";
  if (walls) text << "f 1 2 6 5\nf 3 4 8 7\nf 1 3 7 5\nf 2 4 8 6\n";
  return text.str();
}

GenerateOptions scene_of(const std::string& building) {
  GenerateOptions options = small_scene();
  options.building = building;
  return options;
}

/// Metres from the room's inner faces.
float off(const Eigen::Vector3d& p) {
  const Eigen::Array3d size(6, 4, 2.5);
  return static_cast<float>(p.array().abs().min((p.array() - size).abs()).minCoeff());
}

float share_off(const TemporaryFolder& folder, int fragments) {
  const auto poses = read_poses(folder / "poses.txt");
  std::size_t far = 0, all = 0;
  for (int i = 0; i < fragments; ++i) {
    for (const Eigen::Vector3f& p :
         read_cloud(folder / ("cloud_bin_" + std::to_string(i) + ".ply"))) {
      const Eigen::Vector3d world = poses[static_cast<std::size_t>(i)] * p.cast<double>();
      far += off(world) > 0.08f ? 1 : 0;
      ++all;
    }
  }
  return static_cast<float>(far) / static_cast<float>(all);
}

TEST(Building, IsScannedFromWithin) {
  const TemporaryFolder folder, out;
  const GenerateOptions options = scene_of(folder.write("room.obj", room()));
  generate(out.path(), options);
  for (const Eigen::Isometry3d& pose : read_poses(out / "poses.txt")) {
    const Eigen::Vector3d p = pose.translation();
    EXPECT_TRUE(p.x() > 0.2 && p.x() < 5.8 && p.y() > 0.2 && p.y() < 3.8) << p.transpose();
    EXPECT_TRUE(p.z() > 1.2 && p.z() < 1.8) << p.z();
  }
  EXPECT_LT(share_off(out, options.fragments), 0.01f) << "points that are no surface of the mesh";
}

TEST(Building, ClutterIsSeen) {
  const TemporaryFolder folder, out;
  GenerateOptions options = scene_of(folder.write("room.obj", room()));
  options.clutter = 0.5;
  generate(out.path(), options);
  EXPECT_GT(share_off(out, options.fragments), 0.01f);
}

TEST(Building, SameSeedSameBytes) {
  const TemporaryFolder folder, a, b;
  GenerateOptions options = scene_of(folder.write("room.obj", room()));
  options.clutter = 0.5;
  generate(a.path(), options);
  options.threads = 1;
  generate(b.path(), options);
  EXPECT_TRUE(all_files(a.path()) == all_files(b.path()));
}

/// Standard deviation of the green channel before a wall of the room.
double contrast(const synthetic::Mesh& mesh) {
  const synthetic::RayScene scene(mesh);
  Eigen::Isometry3d camera = Eigen::Isometry3d::Identity();
  camera.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;  // looks along y
  camera.translation() = Eigen::Vector3d(3, 2.5, 1.2);
  const std::vector<std::uint8_t> image = synthetic::render_colour(scene, camera, 1, 0);
  double sum = 0, squares = 0;
  for (std::size_t k = 1; k < image.size(); k += 3) {
    sum += image[k];
    squares += static_cast<double>(image[k]) * image[k];
  }
  const double count = static_cast<double>(image.size()) / 3;
  return std::sqrt(squares / count - sum / count * sum / count);
}

TEST(Building, HasTexture) {
  const TemporaryFolder folder;
  const synthetic::Mesh bare = read_building(folder.write("room.obj", room()));
  synthetic::Mesh a = bare, same = bare, other = bare;
  texture_building(a, 1);
  texture_building(same, 1);
  texture_building(other, 2);
  ASSERT_EQ(a.materials.size(), bare.materials.size());
  for (const synthetic::Material& material : a.palette)
    EXPECT_EQ(material.base, bare.palette[0].base) << "the file's colour stays";
  EXPECT_LT(contrast(bare), 3) << "the camera's noise";
  EXPECT_GT(contrast(a), 6);
  EXPECT_EQ(contrast(a), contrast(same));
  EXPECT_NE(contrast(a), contrast(other));
}

// Parts that touch nowhere have materials of their own.
TEST(Building, EachPartHasItsTexture) {
  const TemporaryFolder folder;
  std::string two = room();
  two += "v 2 1 0\nv 3 1 0\nv 2 1 1\nf 9 10 11\n";
  synthetic::Mesh mesh = read_building(folder.write("two.obj", two));
  ASSERT_EQ(mesh.palette.size(), 1u);
  texture_building(mesh, 1);
  ASSERT_EQ(mesh.palette.size(), 2u);
  EXPECT_EQ(mesh.materials.front(), 0);
  EXPECT_EQ(mesh.materials.back(), 1);
  EXPECT_NE(mesh.palette[0].second, mesh.palette[1].second);
}

TEST(Building, WhereNobodyCanWalk) {
  const TemporaryFolder folder, out;
  const auto refuse = [&](const std::string& content, const std::string& why) {
    const std::string file = folder.write("bad.obj", content);
    expect_error<InvalidArgument>([&] { generate(out.path(), scene_of(file)); }, {"building", why});
  };
  refuse(room(1000), "150 m");                 // millimetres
  refuse(room(0.01), "no place to walk");      // a doll's house
  refuse(room(1, false), "no place to walk");  // floor and ceiling, nothing around
  EXPECT_EQ(out.count(), 0u);
}

TEST(Building, FilesThatHoldNone) {
  const TemporaryFolder folder;
  expect_error<IoError>([&] { read_building(folder / "none.obj"); }, {"none.obj"});
  for (const std::string content : {"", "not a mesh at all\n", "v 0 0 0\nv 1 0 0\nl 1 2\n",
                                    "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"}) {
    const std::string file = folder.write("bad.obj", content);
    expect_error<IoError>([&] { read_building(file); }, {"bad.obj"});
  }
  const std::string whole = room();
  for (std::size_t length = 0; length < whole.size(); length += 7) {
    const std::string file = folder.write("cut.obj", whole.substr(0, length));
    try {
      EXPECT_FALSE(read_building(file).triangles.empty());
    } catch (const IoError&) {
    }
  }
}

/// One triangle in the plane of the first two axes of COLLADA.
std::string collada(const std::string& up) {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset><unit meter="0.01" name="cm"/><up_axis>)" +
         up +
         R"(</up_axis></asset><library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="9">0 0 0 100 0 0 0 200 0</float_array><technique_common><accessor source="#a" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices><triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

TEST(Building, UnitsAndUpAxisOfTheFile) {
  const TemporaryFolder folder;
  const auto extent = [&](const std::string& up) {
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& v : read_building(folder.write(up + ".dae", collada(up))).vertices)
      box.extend(v);
    return Eigen::Vector3f(box.sizes());
  };
  EXPECT_TRUE(extent("Z_UP").isApprox(Eigen::Vector3f(1, 2, 0), 1e-4f))
      << extent("Z_UP").transpose();
  EXPECT_TRUE(extent("Y_UP").isApprox(Eigen::Vector3f(1, 0, 2), 1e-4f))
      << extent("Y_UP").transpose();
}

#else

TEST(Building, SaysThatAssimpIsMissing) {
  expect_error<BackendUnavailable>([] { read_building("room.obj"); }, {"room.obj", "Assimp"});
}

#endif

TEST(Building, ClutterNeedsOne) {
  const TemporaryFolder out;
  GenerateOptions options = small_scene();
  options.clutter = 0.5;
  expect_error<InvalidArgument>([&] { generate(out.path(), options); }, {"clutter", "0.5"});
  options.building = "room.obj";
  for (const double clutter : {-0.1, 2.5, std::nan("")}) {
    options.clutter = clutter;
    expect_error<InvalidArgument>([&] { generate(out.path(), options); }, {"clutter"});
  }
}

}  // namespace
}  // namespace gpureg::test
