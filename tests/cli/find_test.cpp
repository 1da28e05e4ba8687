// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "support/tray.hpp"

namespace gpureg::test {
namespace {

using namespace tray;

/// The boxes as a binary STL file.
std::string write_stl(const TemporaryFolder& folder, const std::string& name,
                      const std::vector<Box>& boxes, double factor = 1) {
  std::string faces;
  std::uint32_t count = 0;
  const auto add = [&](const Eigen::Vector3d& p) {
    for (int k = 0; k < 3; ++k) {
      const float x = static_cast<float>(factor * p[k]);
      faces.append(reinterpret_cast<const char*>(&x), 4);
    }
  };
  for (const Box& box : boxes)
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-1.0, 1.0})
        for (const bool second : {false, true}) {
          const Eigen::Vector3d n = side * Eigen::Vector3d::Unit(axis),
                                u = Eigen::Vector3d::Unit((axis + 1) % 3), v = n.cross(u);
          const auto corner = [&](double a, double b) {
            return Eigen::Vector3d(box.middle + box.half.cwiseProduct(n + a * u + b * v));
          };
          add(n / factor);
          add(corner(-1, -1));
          add(second ? corner(1, 1) : corner(1, -1));
          add(second ? corner(-1, 1) : corner(1, 1));
          faces.append(2, '\0');
          ++count;
        }
  std::string header(80, '\0');
  header.append(reinterpret_cast<const char*>(&count), 4);
  return folder.write(name, header + faces);
}

/// The part as a scanner on a turntable sees it: points alone, none inside.
PointCloud part_scan() {
  PointCloud scan;
  const PointCloud model = model_of(stepped());
  const std::vector<Box> boxes = stepped();
  for (std::size_t k = 0; k < model.points.size(); ++k) {
    const Eigen::Vector3d before = (model.points[k] + 1e-3f * model.normals[k]).cast<double>();
    const auto holds = [&](const Box& box) {
      return ((before - box.middle).cwiseAbs() - box.half).maxCoeff() < 0;
    };
    if (std::none_of(boxes.begin(), boxes.end(), holds)) scan.points.push_back(model.points[k]);
  }
  return scan;
}

std::string write_scene(const TemporaryFolder& folder, const std::string& name,
                        const std::vector<Body>& bodies, float factor = 1) {
  PointCloud scene = scene_of(bodies);
  for (Eigen::Vector3f& p : scene.points) p *= factor;
  return write_cloud(folder, name, scene);
}

/// A frame that has nothing to do with the sensor.
Eigen::Isometry3d elsewhere() { return placed(1, 2, {3, -2, 1}); }

std::string write_moved_scene(const TemporaryFolder& folder, const std::string& name,
                              const std::vector<Body>& bodies) {
  PointCloud scene = scene_of(bodies);
  scene.viewpoints.clear();
  for (Eigen::Vector3f& p : scene.points) p = (elsewhere() * p.cast<double>()).cast<float>();
  return write_cloud(folder, name, scene);
}

std::vector<Body> junk() {
  return {clutter(.7, {-.01, .08, 0}), clutter(-2, {.11, -.07, 0}), clutter(1, {.04, 0, 0})};
}

Outcome find(const std::string& part, const std::string& scene,
             const std::vector<std::string>& more = {}) {
  return run(joined({"find", part, scene, "--backend", "cpu"}, more));
}

/// Displacement of the part's far corner and of its origin, metres, from the nearest body.
double error(const nlohmann::json& instance, const std::vector<Body>& bodies,
             const Eigen::Isometry3d& scene_from_camera = Eigen::Isometry3d::Identity()) {
  Eigen::Matrix4d found;
  for (int k = 0; k < 16; ++k)
    found(k / 4, k % 4) = instance.at("scene_from_part").at(static_cast<std::size_t>(k));
  double least = 1;
  for (const Body& body : bodies) {
    const Eigen::Matrix4d truth = (scene_from_camera * camera_from_world() * body.pose).matrix();
    double most = 0;
    for (const Eigen::Vector4d& p :
         {Eigen::Vector4d(.04, .025, .05, 1), Eigen::Vector4d(0, 0, 0, 1)})
      most = std::max(most, ((found - truth) * p).norm());
    least = std::min(least, most);
  }
  return least;
}

TEST(Find, PrintsAndWritesEveryInstanceOfAMesh) {
  const TemporaryFolder folder;
  std::vector<Body> all = three_parts();
  all.push_back(junk()[0]);
  const std::string part = write_stl(folder, "part.stl", stepped()),
                    scene = write_scene(folder, "scene.ply", all), json = folder / "r.json",
                    image = folder / "r.png";
  const Outcome found = find(part, scene, {"--json", json, "--image", image});
  EXPECT_EQ(found.status, 0) << found.out << found.err;
  expect_holds(found.out, {"status   found: 3 instances of the part were found",
                           "instance 1   confidence", "instance 3", "scene_from_part"});
  const nlohmann::json result = json_of(json);
  EXPECT_EQ(result.at("format_version"), 1);
  EXPECT_EQ(result.at("status"), "found");
  ASSERT_EQ(result.at("instances").size(), 3u);
  double before = 1;
  for (const nlohmann::json& instance : result.at("instances")) {
    EXPECT_LT(error(instance, three_parts()), 0.002);
    EXPECT_LE(instance.at("confidence").get<double>(), before);
    before = instance.at("confidence");
    EXPECT_GT(instance.at("evidence").at("supported").get<double>(), 0.7);
  }
  EXPECT_GT(std::filesystem::file_size(image), 10'000u);
}

TEST(Find, FindsAScanOfThePart) {
  const TemporaryFolder folder;
  const std::vector<Body> one{three_parts()[0]};
  const std::string part = write_cloud(folder, "part.ply", part_scan()),
                    scene = write_scene(folder, "scene.ply", one), json = folder / "r.json";
  const Outcome found = find(part, scene, {"--json", json});
  EXPECT_EQ(found.status, 0) << found.out << found.err;
  const nlohmann::json result = json_of(json);
  ASSERT_EQ(result.at("instances").size(), 1u);
  EXPECT_LT(error(result.at("instances").at(0), one), 0.002);
}

TEST(Find, SaysThatTheViewpointOfAMovedSceneIsNotKnown) {
  const TemporaryFolder folder;
  const std::vector<Body> one{three_parts()[0]};
  const std::string part = write_stl(folder, "part.stl", stepped()),
                    scene = write_moved_scene(folder, "scene.ply", one), json = folder / "r.json";
  const Outcome found = find(part, scene, {"--json", json, "--min-confidence", "0"});
  EXPECT_EQ(found.status, 0) << found.out << found.err;
  expect_holds(found.err, {"--viewpoint"});
  const nlohmann::json result = json_of(json);
  ASSERT_FALSE(result.at("instances").empty());
  EXPECT_LT(error(result.at("instances").at(0), one, elsewhere()), 0.002);
}

TEST(Find, ReportsNothingInScenesWithoutThePart) {
  const TemporaryFolder folder;
  const std::string part = write_stl(folder, "part.stl", stepped());
  for (const std::string& scene :
       {write_scene(folder, "tray.ply", junk()), write_scene(folder, "empty_tray.ply", {}),
        write_moved_scene(folder, "moved_tray.ply", junk()),
        write_moved_scene(folder, "moved_empty_tray.ply", {})}) {
    const Outcome none = find(part, scene);
    EXPECT_EQ(none.status, 1) << none.out << none.err;
    expect_holds(none.out, {"status   not_found", "try      "});
    EXPECT_EQ(none.out.find("instance 1"), std::string::npos) << none.out;
  }
  // A room of metres, and a part as large as a table in it.
  const std::string table = write_stl(folder, "table.stl", stepped(), 15),
                    room = write_cloud(folder, "room.ply", room_scan(0));
  const Outcome foreign = find(table, room);
  EXPECT_EQ(foreign.status, 1) << foreign.out << foreign.err;
}

TEST(Find, SaysWhereASceneMayBeInAnotherUnit) {
  const TemporaryFolder folder;
  const std::string part = write_cloud(folder, "part.ply", part_scan()),
                    large = write_scene(folder, "large.ply", three_parts(), 1000),
                    small = write_scene(folder, "small.ply", three_parts(), 0.001f);
  expect_refused({"find", part, large}, {"the scene extends over", "are the units different"});
  const Outcome none = find(part, small);
  EXPECT_EQ(none.status, 1) << none.out << none.err;
  expect_holds(none.out, {"scene_smaller_than_part", "are both in one unit"});
  EXPECT_EQ(none.out.find("neighbourhoods"), std::string::npos) << none.out;
}

/// Of the points one of so many.
PointCloud thinned_scan(std::size_t points, std::size_t first = 0) {
  const PointCloud scan = part_scan();
  PointCloud thin;
  for (std::size_t k = first; k < scan.points.size(); k += scan.points.size() / points)
    thin.points.push_back(scan.points[k]);
  return thin;
}

TEST(Find, NamesAPartWhosePointsAreFarApart) {
  const TemporaryFolder folder;
  const std::string part = write_cloud(folder, "part.ply", thinned_scan(50)),
                    scene = write_scene(folder, "scene.ply", three_parts());
  expect_refused({"find", part, scene}, {"points of the part", "apart", "a fortieth"});
}

TEST(Find, APartOfFewPointsIsCertainNowhereElse) {
  const TemporaryFolder folder;
  const std::vector<Body> bodies = three_parts();
  const std::string scene = write_scene(folder, "scene.ply", bodies),
                    tray = write_scene(folder, "tray.ply", junk()), json = folder / "r.json";
  for (const std::size_t points : {200u, 500u})
    for (const std::size_t first : {0u, 7u}) {
      const std::string part = write_cloud(folder, "part.ply", thinned_scan(points, first));
      const Outcome found = find(part, scene, {"--json", json});
      expect_holds(found.err, {"coarse for this part"});
      for (const nlohmann::json& instance : json_of(json).at("instances"))
        EXPECT_LT(error(instance, bodies), 0.005) << points << " points\n" << found.out;
      const Outcome none = find(part, tray);
      EXPECT_EQ(none.status, 1) << points << " points\n" << none.out;
    }
}

TEST(Find, CountsThePosesBelowTheThreshold) {
  const TemporaryFolder folder;
  const std::string part = write_stl(folder, "part.stl", stepped()),
                    scene = write_scene(folder, "scene.ply", three_parts()),
                    json = folder / "r.json";
  ASSERT_EQ(find(part, scene, {"--json", json}).status, 0);
  const nlohmann::json all = json_of(json).at("instances");
  ASSERT_EQ(all.size(), 3u);
  const double first = all.at(0).at("confidence"), second = all.at(1).at("confidence");
  ASSERT_GT(first, second);
  const Outcome found =
      find(part, scene, {"--min-confidence", std::to_string((first + second) / 2)});
  EXPECT_EQ(found.status, 0);
  expect_holds(found.out, {"found: 1 instance of the part", "doubtful ", "more, up to 0."});
}

TEST(Find, RefusesBadInput) {
  const TemporaryFolder folder;
  const std::string part = write_cloud(folder, "part.ply", part_scan()),
                    scene = write_scene(folder, "scene.ply", three_parts());
  expect_refused({"find"}, {"PART"});
  expect_refused({"find", part}, {"SCENE"});
  expect_refused({"find", folder / "none.stl", scene}, {"none.stl"});
  expect_refused({"find", part, folder / "none.ply"}, {"none.ply"});
  expect_refused({"find", part, folder.write("bad.ply", "ply\n")}, {"bad.ply"});
  PointCloud nothing;
  const std::string empty = write_cloud(folder, "empty.ply", nothing);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (int k = 0; k < 100; ++k) nothing.points.push_back({nan, 0, 1});
  const std::string hollow = write_cloud(folder, "hollow.ply", nothing);
  for (const std::string& bad : {empty, hollow}) {
    const Outcome of_scene = find(part, bad), of_part = find(bad, scene);
    EXPECT_NE(of_scene.status, 0);
    expect_holds(of_scene.out + of_scene.err, {"scene", "points"});
    EXPECT_NE(of_part.status, 0);
    expect_holds(of_part.out + of_part.err, {"part", "points"});
    EXPECT_EQ((of_scene.out + of_part.out).find("voxels of 0,"), std::string::npos);
  }
  const Outcome swapped = find(scene, part);
  EXPECT_EQ(swapped.status, 1);
  expect_holds(swapped.out, {"is the part the first argument"});
  expect_refused({"find", part, scene, "--voxel-size", "-1"}, {"voxel"});
  expect_refused({"find", part, scene, "--voxel-size", "nan"}, {"voxel"});
  expect_refused({"find", part, scene, "--voxel-size", "0.05"}, {"voxel", "a twentieth"});
  expect_refused({"find", part, scene, "--quality", "11"}, {"--quality"});
  expect_refused({"find", part, scene, "--min-confidence", "2"}, {"--min-confidence"});
  expect_refused({"find", part, scene, "--viewpoint", "here"}, {"--viewpoint"});
  expect_refused({"find", part, scene, "--json", scene}, {"--json"});
  expect_refused({"find", part, scene, "--image", folder / "no/folder.png"}, {"folder"});
}

}  // namespace
}  // namespace gpureg::test
