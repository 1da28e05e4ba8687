// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "gpureg/evaluation.hpp"
#include "support/scan.hpp"

namespace gpureg::test {
namespace {

class Batch : public ::testing::Test {
 protected:
  static constexpr int kScans = 4, kAll = (kScans + 2) * (kScans + 1) / 2;

  Batch() { write_scans(scans_, kScans, true); }

  Outcome batch(const std::string& name, const std::vector<std::string>& more = {}) const {
    return run(joined(joined({"batch", scans_.path(), "-o", out_ / (name + ".log"), "--info",
                              out_ / (name + ".info"), "--json", out_ / (name + ".json")},
                             kSmall),
                      more));
  }

  const TemporaryFolder scans_, out_;
};

TEST_F(Batch, LogAndInformationOfTheAlignedPairs) {
  const Outcome outcome = batch("r");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out,
               {"fragments  6", "pairs      15", "aligned    6, written to",
                "not        9: 5 too_few_source_points, 4 too_little_overlap", "memory"});
  const auto log = evaluation::read_log(out_ / "r.log");
  const auto information = evaluation::read_information(out_ / "r.info");
  ASSERT_EQ(log.size(), 6u);  // the scans of the room, each with each
  ASSERT_EQ(information.size(), 6u);
  for (std::size_t k = 0; k < log.size(); ++k) {
    EXPECT_LT(log[k].i, log[k].j);
    EXPECT_LT(log[k].j, kScans);
    EXPECT_EQ(log[k].count, kScans + 2);
    EXPECT_EQ(information[k].i, log[k].i);
    EXPECT_EQ(information[k].j, log[k].j);
    EXPECT_GT(information[k].information(0, 0), 1000);
    // T_ij takes points of j to i, here to a fraction of the voxels of 0.1 m.
    const Eigen::Isometry3d truth = scan_from_room(log[k].i) * scan_from_room(log[k].j).inverse();
    EXPECT_LT(translation_error(truth, Eigen::Isometry3d(log[k].transform)), 0.05);
    EXPECT_LT(rotation_error_degrees(truth, Eigen::Isometry3d(log[k].transform)), 1);
  }
  EXPECT_EQ(out_.count(), 3u) << "the journal must be gone";
}

TEST_F(Batch, WhatIsFixedToTheSensorIsLeftOutAndNamed) {
  const TemporaryFolder scans;
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  for (int k = 0; k < kScans; ++k) {
    PointCloud scan = room_scan(k);
    for (std::size_t n = scan.points.size() / 5; n > 0; --n)
      scan.points.push_back(
          Eigen::Vector3f(0.3f, 0.05f, 0.1f) +
          0.05f * Eigen::Vector3f(normal(random), normal(random), normal(random)).normalized());
    write_cloud(scans, "cloud_bin_" + std::to_string(k) + ".ply", scan);
  }
  const Outcome outcome = run(joined({"batch", scans.path(), "-o", out_ / "r.log"}, kSmall));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"aligned    6, written to"});
  expect_holds(outcome.err, {"left out as fixed to the sensor", "and some of 3 more scans"});
}

TEST_F(Batch, VoxelSizeByTheFragments) {
  const std::vector<std::string> words = {
      "batch",  scans_.path(),   "-o",        out_ / "r.log", "--info",    out_ / "r.info",
      "--json", out_ / "r.json", "--backend", "cpu",          "--quality", "0"};
  const Outcome outcome = run(words);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"voxel size 0.", ", chosen from the clouds"});
  const auto json = json_of(out_ / "r.json");
  EXPECT_NE(json["options"]["voxel_size"], 0.05);
  EXPECT_GE(json["fragments"][0]["points"], 3000);
  EXPECT_LE(json["fragments"][0]["points"], 20000);
  const TemporaryFolder empty;
  expect_refused({"batch", empty.path(), "-o", out_ / "e.log"}, {empty.path()});
}

TEST_F(Batch, AMapOfItsResultsTakesTheirVoxelSize) {
  ASSERT_EQ(batch("coarse").status, 0);
  const Outcome map = run({"reconstruct", scans_.path(), "--results", out_ / "coarse.json", "-o",
                           out_ / "map", "--no-map", "--no-refine", "--backend", "cpu"});
  ASSERT_EQ(map.status, 0) << map.err;
  expect_holds(map.out, {"voxel size 0.1\n"});
}

TEST_F(Batch, JsonHasEveryFieldOfEveryPair) {
  ASSERT_EQ(batch("r").status, 0);
  const auto json = json_of(out_ / "r.json");
  for (const char* name : {"environment", "options", "folder", "seconds", "peak_memory_mib"})
    EXPECT_TRUE(json.contains(name)) << name;
  EXPECT_EQ(json["complete"], true);
  ASSERT_EQ(json["fragments"].size(), 6u);
  EXPECT_EQ(json["fragments"][5]["number"], 5);
  EXPECT_EQ(json["fragments"][5]["file"], "cloud_bin_5.ply");
  EXPECT_EQ(json["fragments"][5]["input_points"], 2);
  ASSERT_EQ(json["pairs"].size(), static_cast<std::size_t>(kAll));
  std::map<std::string, int> reasons;
  int i = 0, j = 1;
  for (const auto& pair : json["pairs"]) {
    SCOPED_TRACE(pair.dump());
    EXPECT_EQ(pair["i"], i);
    EXPECT_EQ(pair["j"], j);
    if (++j == kScans + 2) j = ++i + 1;
    EXPECT_TRUE(pair["confidence"].is_number());
    for (const char* count :
         {"source_points", "target_points", "correspondences", "hypotheses", "survivors", "scored",
          "points_scored", "consensus", "inliers", "refine_iterations"})
      EXPECT_TRUE(pair["statistics"][count].is_number_unsigned()) << count;
    for (const char* stage : {"match", "propose", "rank", "refine", "verify", "total"})
      EXPECT_GE(pair["ms"][stage].get<double>(), 0) << stage;
    const std::string status = pair["status"], reason = pair["reason"];
    ++reasons[reason];
    EXPECT_EQ(status, reason == "none" ? "aligned" : "not_aligned");
    if (reason == "too_few_source_points")
      EXPECT_TRUE(pair["T_ij"].is_null());
    else if (reason == "none" || reason == "too_little_overlap")
      EXPECT_EQ(pair["T_ij"].size(), 16u);  // the best candidate, reported or not
  }
  EXPECT_EQ(reasons["none"], 6);
  EXPECT_EQ(reasons["too_little_overlap"], kScans);
  EXPECT_EQ(reasons["too_few_source_points"], kScans + 1);
}

TEST_F(Batch, PairsOfAFile) {
  const std::string pairs = out_.write("pairs.txt", "# i j\n3 1\n0 2\n1 3\n0 5\n");
  const Outcome outcome = batch("some", {"--pairs", pairs});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"pairs      3"});  // 3 1 and 1 3 are the same
  const auto json = json_of(out_ / "some.json");
  ASSERT_EQ(json["pairs"].size(), 3u);
  EXPECT_EQ(json["pairs"][0]["i"], 1);
  EXPECT_EQ(json["pairs"][0]["j"], 3);
  EXPECT_EQ(json["pairs"][1]["j"], 2);
  // The same pair among all of them has the same result.
  ASSERT_EQ(batch("all").status, 0);
  const auto all = without_times(json_of(out_ / "all.json"));
  const auto& same = all["pairs"][6];
  EXPECT_EQ(same["i"], 1);
  EXPECT_EQ(same["j"], 3);
  EXPECT_EQ(same, without_times(json)["pairs"][0]);
}

TEST_F(Batch, PairsThatRepeatAndPairsThatCannotBe) {
  const std::string once = out_.write("once.txt", "0 1\n"),
                    twice = out_.write("twice.txt", "0 1\n# not these:\n1 2\n0 1\n\n1 0\n");
  EXPECT_EQ(batch("r", {"--pairs", once}).err.find("note"), std::string::npos);
  const Outcome outcome = batch("r", {"--pairs", twice});
  expect_holds(outcome.err, {"note: 2 of 4 pairs in " + twice + " repeat"});
  expect_holds(outcome.out, {"pairs      2"});
  EXPECT_EQ(batch("r", {"--pairs", twice, "--quiet"}).err, "");
  const std::string bad = out_.write("bad.txt", "# header\n0 1\n\n  # more\n1 2 # right\n9 1\n");
  expect_refused(
      joined({"batch", scans_.path(), "-o", out_ / "b.log", "--pairs", bad, "--quiet"}, kSmall),
      {bad + ":6: there is no fragment 9"});
}

TEST_F(Batch, CamerasThatDoNotMatchTheFragments) {
  const std::string pairs = out_.write("pairs.txt", "0 1\n"), cameras = scans_ / "cameras.txt";
  const auto said = [&](const std::string& content, const std::vector<std::string>& more = {}) {
    scans_.write("cameras.txt", content);
    return batch("r", joined({"--pairs", pairs}, more)).err;
  };
  const auto camera = [](int fragment) { return std::to_string(fragment) + " 0 0 0 0 0 0 0 1\n"; };
  expect_holds(said(""), {"note: 6 of 6 fragments have no camera in " + cameras});
  const std::string most = camera(0) + camera(1) + camera(2) + camera(4);
  expect_holds(said(most), {"note: 2 of 6 fragments have no camera in " + cameras});
  const std::string all = most + camera(3) + camera(5) + camera(5);
  EXPECT_EQ(said(all).find("note"), std::string::npos);
  std::string text = said(all + camera(9));
  expect_holds(text, {"note: " + cameras + " has cameras of fragment 9, which the folder lacks"});
  EXPECT_EQ(text.find("have no camera"), std::string::npos) << text;
  expect_holds(said(all + camera(9) + camera(7)), {"of fragment 7 and 1 more, which"});
  EXPECT_EQ(said(most + camera(9), {"--quiet"}), "");
}

TEST_F(Batch, MinimalScoreIsTheThreshold) {
  ASSERT_EQ(batch("all", {"--min-confidence", "0"}).status, 0);
  // Every pair that has a pose is in the log now.
  EXPECT_EQ(evaluation::read_log(out_ / "all.log").size(), 6u + kScans);
  const Outcome none = batch("none", {"--min-confidence", "1"});
  EXPECT_EQ(none.status, 1) << "no pair aligned";
  EXPECT_TRUE(evaluation::read_log(out_ / "none.log").empty());
  const auto options = json_of(out_ / "none.json")["options"];
  EXPECT_EQ(options["min_confidence"], 1.0);
  // The candidates are the same whatever is reported.
  const auto poses = [&](const char* name) {
    auto pairs = without_times(json_of(out_ / name))["pairs"];
    for (auto& pair : pairs) {
      pair.erase("status");
      pair.erase("reason");
      pair.erase("explanation");
    }
    return pairs;
  };
  EXPECT_EQ(poses("all.json"), poses("none.json"));
}

TEST_F(Batch, MinimalScoreOfLoopsmartIsTheInlierRatio) {
  const auto reported = [&](const std::string& score) {
    const std::string name = "ratio" + score;
    batch(name, joined(kLoopsmart, {"--min-confidence", score}));
    const auto json = json_of(out_ / (name + ".json"));
    EXPECT_EQ(json["options"]["min_confidence"], std::stod(score));
    std::size_t expected = 0;
    for (const auto& pair : json["pairs"]) {
      EXPECT_EQ(pair["confidence"], pair["inlier_ratio"]);
      expected += pair["confidence"].get<double>() >= std::stod(score) && pair["confidence"] > 0;
    }
    const std::size_t found = evaluation::read_log(out_ / (name + ".log")).size();
    EXPECT_EQ(found, expected) << score;
    return found;
  };
  EXPECT_GT(reported("0.05"), reported("0.75"));
}

TEST_F(Batch, QuietSaysNothing) {
  const Outcome outcome = batch("r", {"--quiet"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.out + outcome.err, "");
}

TEST_F(Batch, CamerasOrientTheNormals) {
  ASSERT_EQ(batch("without").status, 0);
  // The sensor of fragment 0 behind its walls: all its normals turn round.
  scans_.write("cameras.txt", "0 0 -9 -9 -9 0 0 0 1\n");
  batch("with");
  EXPECT_NE(content_of(out_ / "with.log"), content_of(out_ / "without.log"));
}

TEST_F(Batch, ReportsImplausibleViewpoints) {
  // A floor with its normals up, as three fragments.
  PointCloud floor;
  for (int x = 0; x < 40; ++x)
    for (int y = 0; y < 40; ++y) floor.points.emplace_back(0.1f * x, 0.1f * y, 0.0f);
  floor.normals.assign(floor.points.size(), Eigen::Vector3f::UnitZ());
  const TemporaryFolder floors;
  for (int k = 0; k < 3; ++k) write_cloud(floors, "cloud_bin_" + std::to_string(k) + ".ply", floor);
  const auto said = [&](float z0, float z1, const std::vector<std::string>& more = {}) {
    std::string cameras;
    for (const auto& [fragment, z] : {std::pair{0, z0}, {1, z1}, {2, 2.0f}})
      cameras += std::to_string(fragment) + " 0 2 2 " + std::to_string(z) + " 0 0 0 1\n";
    floors.write("cameras.txt", cameras);
    return run(joined(joined({"batch", floors.path(), "-o", out_ / "f.log", "--restart"}, kSmall),
                      more))
        .err;
  };
  EXPECT_EQ(said(2, 2).find("note"), std::string::npos);
  const std::string one = said(2, -2);
  expect_holds(one, {"note: 100.0 % of the normals of ", "cloud_bin_1.ply show all viewpoints"});
  EXPECT_EQ(one.find("more clouds"), std::string::npos) << one;
  expect_holds(said(-2, -2), {"cloud_bin_0.ply", "and many of 1 more clouds: are the viewpoints"});
  EXPECT_EQ(said(-2, -2, {"--quiet"}), "");
  // The paper's algorithm asks no viewpoint.
  EXPECT_EQ(said(-2, -2, {"--preset", "loopsmart"}).find("note"), std::string::npos);
}

}  // namespace
}  // namespace gpureg::test
