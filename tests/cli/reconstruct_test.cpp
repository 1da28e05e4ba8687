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

namespace gpureg::test {
namespace {

constexpr int kScans = 5;

class ReconstructCommand : public ::testing::Test {
 protected:
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
    const auto lines = [&] {
      if (!std::filesystem::exists(journal)) return std::ptrdiff_t{0};
      const std::string text = content_of(journal);
      return std::count(text.begin(), text.end(), '\n');
    };
    while (command.running() && lines() < 4)
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

TEST_F(ReconstructCommand, RefusesFoldersThatCannotWork) {
  expect_refused(reconstruct("map"), {"no fragments"});
  write_scans(scans_, 1, false);
  expect_refused(reconstruct("map"), {"one fragment"});
  write_scans(scans_, 2, false);
  expect_refused(joined({"reconstruct", scans_.path(), "-o", scans_.path()}, kSmall),
                 {"different folders"});
  std::ofstream(scans_ / "cloud_bin_2.ply") << "ply\nnothing";
  expect_refused(reconstruct("map"), {"cloud_bin_2.ply"});
}

}  // namespace
}  // namespace gpureg::test
