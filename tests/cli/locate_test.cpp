// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

/// A folder of scans of the room with their poses, and one more scan.
class Locate : public testing::Test {
 protected:
  Locate() {
    write_scans(folder, 4, false);
    std::string poses;
    for (int k = 0; k < 4; ++k) {
      const Eigen::Matrix4d pose = scan_from_room(k).inverse().matrix();
      poses += std::to_string(k) + "\n";
      for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column)
          poses += std::to_string(pose(row, column)) + (column < 3 ? " " : "\n");
    }
    folder.write("poses.txt", poses);
    scan = write_cloud(other, "scan.ply", room_scan(6));
  }

  Outcome locate(const std::vector<std::string>& files, const std::vector<std::string>& more = {}) {
    return run(joined(joined({"locate"}, files), joined({"--backend", "cpu"}, more)));
  }

  TemporaryFolder folder, other;
  std::string scan;
};

TEST_F(Locate, FoundInScansWithPosesAndInTheSavedMapAndStrangersAreNot) {
  const std::string map = other / "room.gpureg", first = other / "first.json",
                    second = other / "second.json";
  const Outcome saved = locate({folder.path()}, {"--voxel-size", "0.1", "--save-map", map});
  EXPECT_EQ(saved.status, 0) << saved.err;
  const Outcome found = locate({scan, folder.path()}, {"--voxel-size", "0.1", "--json", first});
  EXPECT_EQ(found.status, 0) << found.out << found.err;
  expect_holds(found.out, {"status   found", "map_from_scan", "1 tile"});
  EXPECT_EQ(locate({scan, map}, {"--json", second}).status, 0);
  const nlohmann::json a = json_of(first), b = json_of(second);
  EXPECT_EQ(a.at("format_version"), 1);
  EXPECT_EQ(a.at("scans"), b.at("scans"));
  const nlohmann::json& pose = a.at("scans").at(0).at("poses").at(0);
  EXPECT_GT(pose.at("confidence").get<double>(), 0.5);
  const Eigen::Isometry3d truth = scan_from_room(6).inverse();
  for (int k = 0; k < 16; ++k)  // 10 cm voxels: a pose is good to a few centimetres
    EXPECT_NEAR(pose.at("map_from_scan").at(static_cast<std::size_t>(k)).get<double>(),
                truth.matrix()(k / 4, k % 4), 0.08);

  const Outcome automatic = locate({scan, folder.path()}, {"--voxel-size", "auto"});
  EXPECT_EQ(automatic.status, 0) << automatic.out << automatic.err;
  expect_holds(automatic.out, {"voxels of 0.", ", chosen from the clouds"});

  const std::string stranger = write_cloud(other, "stranger.ply", sticks());
  const Outcome nowhere = locate({scan, stranger, map});
  EXPECT_EQ(nowhere.status, 1);
  expect_holds(nowhere.out, {"status   found", "status   not_found"});
}

TEST_F(Locate, TheLargestIslandOfAReconstructionIsTheMap) {
  const std::string name = std::filesystem::path(folder.path()).filename().string();
  const TemporaryFolder map;
  const auto document = [&](const std::string& scans) {
    nlohmann::json json = {{"format_version", 1}, {"folder", scans}, {"islands", {{0, 1, 2}, {3}}}};
    for (int k = 0; k < 4; ++k) {
      const Eigen::Matrix4d columns = scan_from_room(k).inverse().matrix().transpose();
      json["scans"].push_back(
          {{"id", k},
           {"island", k / 3},
           {"island_from_scan", std::vector<double>(columns.data(), columns.data() + 16)}});
    }
    map.write("reconstruction.json", json.dump());
  };
  document(folder.path());
  const Outcome found = locate({scan, map.path()}, {"--voxel-size", "0.1"});
  EXPECT_EQ(found.status, 0) << found.out << found.err;
  expect_holds(found.err, {"2 islands", "the largest one"});
  document("/nowhere/" + name);  // moved, together with the map
  EXPECT_EQ(locate({map.path()}, {"--voxel-size", "0.1", "--save-map", other / "m"}).status, 0);
  document("/nowhere/scans");
  expect_refused({"locate", scan, map.path()}, {"reconstruction.json", "/nowhere/scans"});
}

TEST_F(Locate, ScansWithOdometryAreOneScan) {
  const std::string map = other / "room.gpureg";
  ASSERT_EQ(locate({folder.path()}, {"--voxel-size", "0.1", "--save-map", map}).status, 0);
  const TemporaryFolder walk;
  std::string poses;
  for (int k = 0; k < 2; ++k) {
    write_cloud(walk, "cloud_bin_" + std::to_string(k) + ".ply", room_scan(5 + k));
    const Eigen::Matrix4d pose = (scan_from_room(5) * scan_from_room(5 + k).inverse()).matrix();
    poses += std::to_string(k) + "\n";
    for (int n = 0; n < 16; ++n)
      poses += std::to_string(pose(n / 4, n % 4)) + (n % 4 < 3 ? " " : "\n");
  }
  walk.write("poses.txt", poses);
  const std::string json = other / "walk.json";
  const Outcome found = locate({walk.path(), map}, {"--json", json});
  EXPECT_EQ(found.status, 0) << found.out << found.err;
  const nlohmann::json document = json_of(json);
  const nlohmann::json& pose = document.at("scans").at(0).at("poses").at(0);
  const Eigen::Isometry3d truth = scan_from_room(5).inverse();
  for (int k = 0; k < 16; ++k)  // 10 cm voxels: a pose is good to a few centimetres
    EXPECT_NEAR(pose.at("map_from_scan").at(static_cast<std::size_t>(k)).get<double>(),
                truth.matrix()(k / 4, k % 4), 0.08);
}

TEST_F(Locate, WhatHasChangedIsLabelled) {
  const auto change = [&](const std::string& file, const std::vector<std::string>& more) {
    return run(
        joined({"change", file, folder.path(), "--voxel-size", "0.1", "--backend", "cpu"}, more));
  };
  const std::string json = other / "change.json", ply = other / "scan_changes.ply";
  const Outcome same =
      change(scan, {"--json", json, "--scan-ply", ply, "--map-ply", other / "m.ply"});
  EXPECT_EQ(same.status, 0) << same.out << same.err;
  expect_holds(same.out, {"status   found", "scan     same", "map      same"});
  const nlohmann::json document = json_of(json);
  EXPECT_EQ(document.at("located").at("status"), "found");
  const nlohmann::json& points = document.at("scan");
  EXPECT_GT(points.at("same").get<double>(), 0.9 * points.at("points").get<double>());
  EXPECT_LT(points.at("new").get<double>(), 0.01 * points.at("points").get<double>());
  EXPECT_EQ(content_of(ply).rfind("ply\nformat binary_little_endian 1.0", 0), 0u);

  std::string numbers;
  for (const nlohmann::json& number : document.at("map_from_scan")) numbers += number.dump() + " ";
  other.write("pose.txt", numbers);
  const Outcome posed = change(scan, {"--pose", other / "pose.txt", "--json", json});
  EXPECT_EQ(posed.status, 0) << posed.err;
  EXPECT_FALSE(json_of(json).contains("located"));
  EXPECT_EQ(change(write_cloud(other, "stranger.ply", sticks()), {}).status, 1);
  other.write("pose.txt", "1 0 0 0 0 1");
  expect_refused({"change", scan, folder.path(), "--pose", other / "pose.txt"},
                 {"pose.txt:1", "6 fields", "4 x 4"});
  expect_refused({"change", scan, folder.path(), "--json", scan}, {"scan.ply"});
  expect_refused({"change", scan, folder.path(), "--tolerance", "0"}, {"tolerance is 0"});
}

TEST_F(Locate, ThresholdsOfPairsAreNotThoseOfPlaces) {
  const std::string map = other / "room.gpureg", json = other / "r.json";
  ASSERT_EQ(locate({folder.path()}, {"--voxel-size", "0.1", "--save-map", map}).status, 0);
  const auto threshold = [&](const std::vector<std::string>& more) {
    const Outcome outcome = locate({scan, map}, joined({"--json", json}, more));
    EXPECT_LE(outcome.status, 1) << outcome.err;
    return json_of(json).at("options").at("min_confidence");
  };
  EXPECT_EQ(threshold({}), 0.75);
  // As good as any other number, though it is the default of pairs.
  EXPECT_EQ(threshold({"--set", "min_confidence=0.5"}), 0.5);
  EXPECT_EQ(threshold({"--min-confidence", "0.5"}), 0.5);
  EXPECT_EQ(threshold({"--min-confidence", "1"}), 1);
  EXPECT_EQ(locate({scan, map}, {"--min-confidence", "1"}).status, 1);
  const std::string calibration = other.write(
      "c.json",
      R"({"gpureg":"calibration","slope":1,"offset":0,"voxel_size":5,"risk":{"min_confidence":0.2}})");
  for (const char* verb : {"locate", "change"})
    expect_refused({verb, scan, map, "--calibration", calibration}, {"--calibration"});
  expect_refused({"locate", scan, map, "--set", "calibration.offset=1"},
                 {"registration.calibration"});
}

TEST_F(Locate, RefusesWhatCannotBe) {
  expect_refused({"locate", scan}, {"expected scans and then the map"});
  expect_refused({"locate", scan, other.path()}, {other.path(), "poses.txt", "trajectory.txt"});
  expect_refused({"locate", scan, other / "missing.ply"}, {"missing.ply"});
  expect_refused({"locate", scan, scan, "--near", "1,2,3"}, {"--near", "x,y,z,radius"});
  expect_refused({"locate", scan, scan, "--json", scan}, {"scan.ply"});
  expect_refused({"locate", scan, scan, "--voxel-size", "0.1", "--preset", "loopsmart"},
                 {"method", "quadruples"});
  const std::string map = other / "room.gpureg";
  ASSERT_EQ(locate({scan}, {"--voxel-size", "0.1", "--save-map", map}).status, 0);
  expect_refused({"locate", scan, map, "--voxel-size", "0.05"}, {map, "0.1"});
  const std::string content = content_of(map);
  other.write("room.gpureg", content.substr(0, content.size() / 2));
  expect_refused({"locate", scan, map}, {"room.gpureg", "truncated"});
  PointCloud millimetres = room_scan(6);
  for (Eigen::Vector3f& p : millimetres.points) p *= 1000;
  expect_refused({"locate", write_cloud(other, "mm.ply", millimetres), scan, "--voxel-size", "0.1"},
                 {"mm.ply", "millimetres"});
}

}  // namespace
}  // namespace gpureg::test
