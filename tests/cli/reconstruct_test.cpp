// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "gpureg/io.hpp"
#include "gpureg/sets/pair_journal.hpp"

namespace gpureg::test {
namespace {

/// The data of a page.
class ReconstructCommand : public ::testing::Test {
 protected:
  static constexpr int kScans = 5;

  std::vector<std::string> reconstruct(const std::string& name,
                                       const std::vector<std::string>& more = {}) const {
    return joined(joined({"reconstruct", scans_.path(), "-o", out_ / name}, kSmall), more);
  }

  std::string file(const std::string& name, const std::string& file_name) const {
    return (std::filesystem::path(out_ / name) / file_name).string();
  }

  std::map<int, Eigen::Isometry3d> poses(const std::string& name) const {
    std::ifstream text(file(name, "poses.txt"));
    std::map<int, Eigen::Isometry3d> out;
    for (int number; text >> number;)
      for (int k = 0; k < 16; ++k) text >> out[number].matrix()(k / 4, k % 4);
    return out;
  }

  void expect_same_map(const std::string& a, const std::string& b) const {
    for (const char* name : {"poses.txt", "trajectory.txt", "edges.log", "graph.g2o", "map.ply"})
      EXPECT_TRUE(content_of(file(a, name)) == content_of(file(b, name))) << name << " differs";
  }

  const TemporaryFolder scans_, out_;
};

TEST_F(ReconstructCommand, PlacesTheScansOfARoomAndLeavesOutTheRest) {
  write_scans(scans_, kScans, true);
  const Outcome outcome = run(reconstruct("map"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"placed     5 of 7", "left out   6"});

  const auto document = json_of(file("map", "reconstruction.json"));
  EXPECT_EQ(document.at("islands"), nlohmann::json::parse("[[0,1,2,3,4]]"));
  EXPECT_EQ(document.at("scans").at(6).at("reason"), "too_few_points");
  EXPECT_FALSE(document.at("scans").at(5).at("placed"));
  EXPECT_NE(document.at("scans").at(5).at("reason"), "none");

  const auto placed = poses("map");
  ASSERT_EQ(placed.size(), 5u);
  for (const auto& [number, pose] : placed) {
    const Eigen::Isometry3d truth = scan_from_room(0) * scan_from_room(number).inverse();
    // A fifth of the voxel of 10 cm, for millimetres of noise.
    EXPECT_LT((pose.translation() - truth.translation()).norm(), 0.02) << number;
  }
  EXPECT_GT(io::read_point_cloud(file("map", "map.ply")).points.size(), 1000u);
  EXPECT_FALSE(std::filesystem::exists(file("map", "pairs.journal")));
}

TEST_F(ReconstructCommand, TakesTheResultsOfAnEarlierRun) {
  write_scans(scans_, kScans, false);
  ASSERT_EQ(run(reconstruct("first")).status, 0);
  ASSERT_EQ(run(reconstruct("second", {"--results", file("first", "pairs.json")})).status, 0);
  expect_same_map("first", "second");
  EXPECT_FALSE(std::filesystem::exists(file("second", "pairs.json")));
  expect_refused(reconstruct("third", {"--results", file("first", "poses.txt")}), {"poses.txt"});
}

TEST_F(ReconstructCommand, GoesOnAfterAnInterruption) {
  constexpr int kMore = 8;
  write_scans(scans_, kMore, false);
  ASSERT_EQ(run(reconstruct("whole")).status, 0);
  {
    Command command(reconstruct("parts", {"--threads", "1"}));
    const std::string journal = file("parts", "pairs.journal");
    const auto pairs = [&] { return is_journal(journal) ? read_journal(journal).pairs.size() : 0; };
    while (command.running() && pairs() < 3)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    command.send(SIGINT);
    const Outcome outcome = command.wait();
    ASSERT_EQ(outcome.status, 130);
    expect_holds(outcome.err, {"--resume"});
  }
  EXPECT_FALSE(std::filesystem::exists(file("parts", "poses.txt")));
  expect_refused(reconstruct("parts"), {"--resume", "--restart"});
  ASSERT_EQ(run(reconstruct("parts", {"--resume"})).status, 0);
  expect_same_map("whole", "parts");
}

TEST_F(ReconstructCommand, OdometryPlacesWhatPairsCannot) {
  write_scans(scans_, kScans, true);
  std::string odometry;
  for (int k = 0; k < kScans + 2; ++k) {
    const Eigen::Isometry3d room_from_scan = scan_from_room(k).inverse();
    const Eigen::Quaterniond q(Eigen::Matrix3d(room_from_scan.linear()));
    std::ostringstream line;
    line.precision(12);
    line << k << " " << room_from_scan.translation().transpose() << " " << q.x() << " " << q.y()
         << " " << q.z() << " " << q.w() << "\n";
    odometry += line.str();
  }
  std::ofstream(out_ / "odometry.txt") << odometry;
  const Outcome outcome = run(reconstruct("map", {"--odometry", out_ / "odometry.txt"}));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"odometry   6 poses", "placed     7 of 7", "note       6"});
  const auto document = json_of(file("map", "reconstruction.json"));
  EXPECT_EQ(document.at("scans").at(6).at("reason"), "odometry_only");
  EXPECT_EQ(document.at("scans").at(1).at("reason"), "none");
  std::ofstream(out_ / "odometry.txt") << "0.5 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n";
  expect_refused(reconstruct("other", {"--odometry", out_ / "odometry.txt"}),
                 {"odometry.txt", "0.5"});
  std::ofstream(out_ / "odometry.log") << "0 99 7\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  expect_refused(reconstruct("other", {"--odometry", out_ / "odometry.log"}),
                 {"odometry.log", "fragment 99"});
  expect_refused(reconstruct("other", {"--drift", "0.1"}), {"--odometry"});
}

TEST_F(ReconstructCommand, PruningTriesFewerPairs) {
  constexpr int kMore = 8;
  write_scans(scans_, kMore, false);
  ASSERT_EQ(run(reconstruct("map", {"--prune", "2"})).status, 0);
  const auto pairs = json_of(file("map", "pairs.json")).at("pairs").size();
  EXPECT_GE(pairs, 8u);  // every scan has two
  EXPECT_LE(pairs, 16u);
  expect_refused(reconstruct("other", {"--prune", "0"}), {"--prune"});
}

TEST_F(ReconstructCommand, ThePageIsSelfContained) {
  write_scans(scans_, kScans, true);
  ASSERT_EQ(run(reconstruct("map")).status, 0);
  const std::string page = content_of(file("map", "map.html"));
  expect_holds(page, {"5 scans are placed in one map; 2 scans are left out.", "getContext('webgl'",
                      "the scan has too few points"});
  expect_self_contained(page);
  const auto data = data_of(page);
  EXPECT_EQ(data.at("figures").at("placed"), 5);
  std::size_t points = 0;
  for (const auto& scan : data.at("scans")) points += scan.at("count").get<std::size_t>();
  constexpr std::size_t kBytesPerPoint = 10;
  EXPECT_EQ(data.at("points").get<std::string>().size(), (kBytesPerPoint * points + 2) / 3 * 4);
  EXPECT_GT(points, 1000u);
  EXPECT_EQ(data.at("figures").at("points_shown"), points);
  EXPECT_GE(data.at("figures").at("points"), points);
  ASSERT_EQ(run(reconstruct("plain", {"--no-map"})).status, 0);
  EXPECT_FALSE(std::filesystem::exists(file("plain", "map.html")));
}

TEST_F(ReconstructCommand, AFolderMayHaveTheNameOfAMark) {
  const std::filesystem::path folder = std::filesystem::path(scans_.path()) / "{{data}}<b>";
  write_scans(scans_, 2, false);
  std::filesystem::create_directory(folder);
  for (const char* name : {"cloud_bin_0.ply", "cloud_bin_1.ply"})
    std::filesystem::rename(scans_ / name, folder / name);
  const auto arguments =
      joined({"reconstruct", folder.string(), "-o", out_ / "map", "--no-refine"}, kSmall);
  run(arguments);
  const std::string page = content_of(file("map", "map.html"));
  expect_holds(page, {"<title>gpureg map: {{data}}&lt;b&gt;</title>"});
  EXPECT_EQ(data_of(page).at("scans").size(), 2u);
}

// The page draws a scan at its sensor, or at the mean of its points where that is not known.
TEST_F(ReconstructCommand, KeepsTheViewpointOfAFileThatCamerasLack) {
  const Eigen::Vector3f shift(5, 0, 0);
  for (int k = 0; k < 2; ++k) {
    const PointCloud cloud = room_scan(k);
    std::ostringstream pcd;
    pcd << "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH "
        << cloud.points.size() << "\nHEIGHT 1\nVIEWPOINT 5 0 0 1 0 0 0\nPOINTS "
        << cloud.points.size() << "\nDATA ascii\n";
    for (const Eigen::Vector3f& p : cloud.points) pcd << (p + shift).transpose() << "\n";
    scans_.write("cloud_bin_" + std::to_string(k) + ".pcd", pcd.str());
  }
  scans_.write("cameras.txt", "1 0 5 0 0 0 0 0 1\n");
  const Outcome outcome = run(reconstruct("map", {"--no-refine"}));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const nlohmann::json position =
      data_of(content_of(file("map", "map.html"))).at("scans").at(0).at("position");
  EXPECT_EQ(position, nlohmann::json::parse("[5, 0, 0]"));
}

TEST_F(ReconstructCommand, DamagedResultsAreNamed) {
  write_scans(scans_, kScans, false);
  ASSERT_EQ(run(reconstruct("map", {"--no-refine", "--no-map"})).status, 0);
  const auto whole = json_of(file("map", "pairs.json"));
  const std::string path = out_ / "damaged.json";
  const auto refused = [&](const nlohmann::json& document, const std::string& place,
                           const std::string& what) {
    std::ofstream(path) << document;
    expect_refused(reconstruct("other", {"--results", path}), {"damaged.json", place, what});
  };
  const std::string text = whole.dump();
  std::ofstream(path) << text.substr(0, text.size() / 2);
  expect_refused(reconstruct("other", {"--results", path}), {"damaged.json"});
  auto document = whole;
  document["pairs"][3]["T_ij"] = {1, 2, 3};
  refused(document, "pairs[3]", "T_ij");
  document = whole;
  document["pairs"][2]["information"] = "lost";
  refused(document, "pairs[2]", "information");
  document = whole;
  document["pairs"][1]["modes"] = 7;
  refused(document, "pairs[1]", "modes");
  document = whole;
  document["pairs"][4]["j"] = 77;
  refused(document, "pairs[4]", "fragment 77");
  document = whole;
  document["pairs"][4] = document["pairs"][0];
  refused(document, "pairs[4]", "stands twice");
  document = whole;
  document["pairs"][0]["confidence"] = "high";
  refused(document, "pairs[0]", "confidence");
}

TEST_F(ReconstructCommand, AFullDiskIsNamedAndTheJournalStays) {
  write_scans(scans_, kScans, false);
  Surroundings around;
  around.file_bytes = 200'000;  // enough for the journal, too little for the map's files
  const Outcome outcome = Command(reconstruct("map", {"--map-voxel-size", "0.01"}), around).wait();
  EXPECT_EQ(outcome.status, 2);
  expect_holds(outcome.err, {"cannot write", file("map", "")});
  EXPECT_TRUE(std::filesystem::exists(file("map", "pairs.journal")));
  ASSERT_EQ(run(reconstruct("map", {"--resume"})).status, 0);
  ASSERT_EQ(run(reconstruct("whole")).status, 0);
  expect_same_map("whole", "map");
}

TEST_F(ReconstructCommand, AnEarlierMapLeavesNothing) {
  write_scans(scans_, kScans, false);
  write_scans_of_another_room(scans_, kScans, 4);
  ASSERT_EQ(run(reconstruct("map", {"--no-refine"})).status, 0);
  const std::vector<std::string> further = {"poses_1.txt", "trajectory_1.txt", "graph_1.g2o",
                                            "map_1.ply"};
  for (const std::string& name : further) EXPECT_TRUE(std::filesystem::exists(file("map", name)));
  expect_refused(reconstruct("map", {"--odometry", file("map", "poses_1.txt")}),
                 {"--odometry", "poses_1.txt"});
  for (int k = 0; k < 4; ++k)
    std::filesystem::remove(scans_ / ("cloud_bin_" + std::to_string(kScans + k) + ".ply"));
  for (const char* name : {".gpureg-1-0.tmp", "map_1.txt", "map_01.ply"})
    std::ofstream(file("map", name)) << "x";
  ASSERT_EQ(run(reconstruct("map", {"--no-map"})).status, 0);
  for (const std::string& name : further) EXPECT_FALSE(std::filesystem::exists(file("map", name)));
  for (const char* name : {"map.ply", "map.html", ".gpureg-1-0.tmp"})
    EXPECT_FALSE(std::filesystem::exists(file("map", name))) << name;
  for (const char* name : {"map_1.txt", "map_01.ply", "poses.txt", "reconstruction.json"})
    EXPECT_TRUE(std::filesystem::exists(file("map", name))) << name;
  // The pairs of the map make another one in their folder; others would leave these beside it.
  std::filesystem::copy_file(file("map", "pairs.json"), out_ / "others.json");
  expect_refused(reconstruct("map", {"--results", out_ / "others.json"}),
                 {"pairs of another map", file("map", "pairs.json")});
  ASSERT_EQ(run(reconstruct("map", {"--results", file("map", "pairs.json")})).status, 0);
  EXPECT_TRUE(std::filesystem::exists(file("map", "pairs.json")));
}

TEST_F(ReconstructCommand, WhatIsNotFinishedIsNoMap) {
  write_scans(scans_, kScans, false);
  ASSERT_EQ(run(reconstruct("map", {"--no-refine"})).status, 0);
  Surroundings around;
  around.file_bytes = 200'000;  // enough for the poses, too little for the map's points
  const std::vector<std::string> finer = {"--map-voxel-size", "0.01"};
  EXPECT_EQ(Command(reconstruct("map", finer), around).wait().status, 2);
  EXPECT_TRUE(std::filesystem::exists(file("map", "poses.txt")));
  EXPECT_FALSE(std::filesystem::exists(file("map", "reconstruction.json")));
  expect_refused({"audit", scans_.path(), out_ / "map"}, {"reconstruction.json"});
  expect_refused({"locate", scans_ / "cloud_bin_0.ply", out_ / "map"}, {"reconstruction.json"});
  ASSERT_EQ(run(reconstruct("map", joined(finer, {"--resume"}))).status, 0);
  EXPECT_TRUE(std::filesystem::exists(file("map", "reconstruction.json")));
}

// After the pairs, the map is made and audited.
TEST_F(ReconstructCommand, CtrlCEndsTheAudit) {
  constexpr int kMore = 12;
  write_scans(scans_, kMore, false);
  Command command(reconstruct("map", {"--threads", "1"}));
  while (command.running() && !std::filesystem::exists(file("map", "pairs.json")))
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  command.send(SIGINT);
  const Outcome outcome = command.wait();
  EXPECT_EQ(outcome.status, 130);
  expect_holds(outcome.err, {"interrupted", "66 of 66", "--resume"});
  for (const char* name : {"poses.txt", "map.ply", "reconstruction.json"})
    EXPECT_FALSE(std::filesystem::exists(file("map", name))) << name;
  ASSERT_EQ(run(reconstruct("map", {"--resume"})).status, 0);
}

TEST_F(ReconstructCommand, RefusesFoldersThatCannotWork) {
  expect_refused(reconstruct("map"), {"is empty"});
  write_scans(scans_, 1, false);
  expect_refused(reconstruct("map"), {"one scan"});
  write_scans(scans_, 2, false);
  expect_refused(joined({"reconstruct", scans_.path(), "-o", scans_.path()}, kSmall),
                 {"different folders"});
  // Of three scans a bad one is left out, of two none is left to make a map with.
  std::ofstream(scans_ / "cloud_bin_1.ply") << "ply\nnothing";
  expect_refused(reconstruct("map"), {"cloud_bin_1.ply"});
  std::ofstream(scans_ / "cloud_bin_1.pcd") << "the same number again";
  expect_refused(reconstruct("map"), {"cloud_bin_1"});
}

}  // namespace
}  // namespace gpureg::test
