// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

class AuditCommand : public ::testing::Test {
 protected:
  static constexpr int kScans = 6;

  AuditCommand() { write_scans(scans_, kScans, false); }

  /// The true poses; scan `moved` is a metre off.
  std::string poses(const std::string& name, int moved = -1, double scale = 1) const {
    std::ofstream file(out_ / name);
    for (int k = 0; k < kScans; ++k) {
      Eigen::Matrix4d pose = scan_from_room(k).inverse().matrix();
      if (k == moved) pose.topRightCorner<3, 1>() += Eigen::Vector3d(0.6, 0.48, 0.64);
      pose.topLeftCorner<3, 3>() *= scale;
      file.precision(17);
      file << k << "\n" << pose << "\n";
    }
    return out_ / name;
  }

  Outcome audit(const std::string& poses, const std::vector<std::string>& more = {}) const {
    return run(joined(joined({"audit", scans_.path(), poses}, kSmall), more));
  }

  const TemporaryFolder scans_, out_;
};

TEST_F(AuditCommand, ARightMapIsSound) {
  const Outcome outcome = audit(poses("right.txt"), {"--json", out_ / "right.json"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"verdict    sound"});
  const auto document = json_of(out_ / "right.json");
  EXPECT_EQ(document.at("gpureg"), "audit");
  EXPECT_EQ(document.at("verdict"), "sound");
  EXPECT_EQ(document.at("islands"),
            nlohmann::json::parse(R"([{"scans": [[0, 5]], "verdict": "sound"}])"));
  EXPECT_EQ(document.at("near_pairs"), kScans * (kScans - 1) / 2);
  EXPECT_TRUE(document.contains("format_version"));
}

TEST_F(AuditCommand, AWrongScanIsNamed) {
  const Outcome outcome =
      audit(poses("wrong.txt", 3), {"--json", out_ / "wrong.json", "--page", out_ / "wrong.html"});
  EXPECT_EQ(outcome.status, 1) << outcome.err;
  expect_holds(outcome.out, {"verdict    contradicted", "broken     scan 3:"});
  const auto worst = json_of(out_ / "wrong.json").at("connections").at(0);
  EXPECT_EQ(worst.at("scans"), nlohmann::json::parse("[[3, 3]]"));
  EXPECT_EQ(worst.at("verdict"), "contradicted");
  const std::string page = content_of(out_ / "wrong.html");
  expect_holds(page, {"Contradicted", "Broken at scan 3", "<svg"});
}

TEST_F(AuditCommand, PosesThatAreInvertedAreNamed) {
  std::ofstream file(out_ / "inverted.txt");
  file.precision(17);
  for (int k = 0; k < kScans; ++k) file << k << "\n" << scan_from_room(k).matrix() << "\n";
  file.close();
  const Outcome outcome = audit(out_ / "inverted.txt");
  EXPECT_EQ(outcome.status, 1) << outcome.err;
  expect_holds(outcome.out, {"try        the poses look inverted", "expected map_from_scan"});
}

TEST_F(AuditCommand, PosesThatKeepAllScansApartAreNoSoundMap) {
  std::ofstream file(out_ / "apart.txt");
  for (int k = 0; k < kScans; ++k) file << k << " " << 1000 * k << " 0 0 0 0 0 1\n";
  file.close();
  const std::vector<std::string> outputs = {
      "--json", out_ / "apart.json", "--page", out_ / "apart.html", "--mend", out_ / "mended.txt"};
  const Outcome outcome = audit(out_ / "apart.txt", outputs);
  EXPECT_EQ(outcome.status, 1) << outcome.err;
  expect_holds(outcome.out, {"verdict    undecided", "in the unit of their points?",
                             "0 scans moved, 0 left out; undecided"});
  EXPECT_EQ(json_of(out_ / "apart.json").at("verdict"), "undecided");
  const std::string page = content_of(out_ / "apart.html");
  expect_holds(page, {">Undecided</h1>"});
  EXPECT_EQ(page.find("Sound"), std::string::npos);
}

// Each has a frame of its own, in which the other one would lie across it.
TEST_F(AuditCommand, TwoRoomsInOneFolderAreTwoSoundIslands) {
  write_scans_of_another_room(scans_, kScans, 5);
  const std::string map = out_ / "map", mended = out_ / "mended.txt";
  ASSERT_EQ(
      run(joined({"reconstruct", scans_.path(), "-o", map, "--no-refine", "--no-map"}, kSmall))
          .status,
      0);
  ASSERT_EQ(json_of(map + "/reconstruction.json").at("islands"),
            nlohmann::json::parse("[[0, 1, 2, 3, 4, 5], [6, 7, 8, 9, 10]]"));
  const std::vector<std::string> outputs = {"--json",          out_ / "map.json", "--page",
                                            out_ / "map.html", "--mend",          mended};
  const Outcome outcome = audit(map, outputs);
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  expect_holds(outcome.out, {"11 with a pose, 0 without", "island     scans 0-5: sound",
                             "island     scans 6-10: sound", "0 scans moved, 0 left out; sound"});
  const auto islands = json_of(out_ / "map.json").at("islands");
  ASSERT_EQ(islands.size(), 2u);
  EXPECT_EQ(islands.at(1), nlohmann::json::parse(R"({"scans": [[6, 10]], "verdict": "sound"})"));
  expect_holds(content_of(out_ / "map.html"), {">Sound</h1>", "Island 1, scans 6-10: sound"});
  // TUM with a line of comment, one file for each frame.
  const auto lines = [](const std::string& path) {
    const std::string text = content_of(path);
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_EQ(lines(mended), 1 + 6);
  EXPECT_EQ(lines(out_ / "mended_1.txt"), 1 + 5);

  expect_holds(audit(map + "/edges.log").out, {"11 with a pose", "island     scans 6-10: sound"});
  const Outcome first = audit(map + "/poses.txt"), second = audit(map + "/graph_1.g2o");
  EXPECT_EQ(first.status, 0);
  expect_holds(first.out, {"6 with a pose, 5 without"});
  EXPECT_EQ(second.status, 0);
  expect_holds(second.out, {"5 with a pose, 6 without"});
  expect_refused(
      joined({"audit", scans_.path(), map, "--mend", mended, "--json", out_ / "mended_1.txt"},
             kSmall),
      {"--mend", "mended_1.txt"});

  std::filesystem::remove(map + "/reconstruction.json");
  expect_refused({"audit", scans_.path(), map}, {"has no reconstruction.json"});
  std::ofstream(map + "/reconstruction.json") << R"({"folder": ".", "islands": [[0]], "scans": [
      {"id": 0, "island": 1, "island_from_scan": [1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}]})";
  expect_refused({"audit", scans_.path(), map}, {"reconstruction.json", "island 1 of 1"});
}

// The page is a pipe: when it has been read, the map is mended.
TEST_F(AuditCommand, CtrlCEndsTheMending) {
  constexpr int kMore = 24;
  write_scans(scans_, kMore, false);
  std::ofstream file(out_ / "wrong.txt");
  for (int k = 0; k < kMore; ++k) {
    Eigen::Matrix4d pose = scan_from_room(k).inverse().matrix();
    if (k >= kMore / 2) pose.topRightCorner<3, 1>() += Eigen::Vector3d(0.6, 0.48, 0.64);
    file << k << "\n" << pose << "\n";
  }
  file.close();
  const std::string page = out_ / "page", mended = out_ / "mended.txt";
  ASSERT_EQ(::mkfifo(page.c_str(), 0600), 0);
  Command command(joined({"audit", scans_.path(), out_ / "wrong.txt", "--page", page, "--mend",
                          mended, "--threads", "1"},
                         kSmall));
  expect_holds(content_of(page), {"Contradicted"});
  command.send(SIGINT);
  const Outcome outcome = command.wait();
  EXPECT_EQ(outcome.status, 130);
  expect_holds(outcome.err, {"interrupted"});
  EXPECT_FALSE(std::filesystem::exists(mended));
}

TEST_F(AuditCommand, AMissingScanIsNamed) {
  std::ifstream whole(poses("right.txt"));
  std::ofstream part(out_ / "part.txt");
  std::string line;
  for (int n = 0; std::getline(whole, line); ++n)
    if (n < 10 || n >= 15) part << line << "\n";  // without scan 2
  part.close();
  const Outcome outcome = audit(out_ / "part.txt", {"--json", out_ / "part.json"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"5 with a pose, 1 without"});
  EXPECT_EQ(json_of(out_ / "part.json").at("missing"), nlohmann::json::parse("[2]"));
}

TEST_F(AuditCommand, BadLogsAreErrors) {
  const auto log = [&](const std::string& name, const std::string& first) {
    std::ofstream file(out_ / name);
    for (int k = 0; k + 1 < kScans; ++k)
      file << k << " " << k + 1 << " " << kScans << "\n"
           << (k == 2 ? first : "1") << " 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    return out_ / name;
  };
  for (const std::string first : {"nan", "-1", "1.5"}) {
    const Outcome outcome = audit(log("bad.log", first));
    EXPECT_EQ(outcome.status, 2) << first;
    expect_holds(outcome.err, {"bad.log"});
  }
}

TEST_F(AuditCommand, BadPosesAreErrors) {
  EXPECT_EQ(audit(out_ / "none.txt").status, 2);
  const Outcome scaled = audit(poses("scaled.txt", -1, 1.1));
  EXPECT_EQ(scaled.status, 2);
  expect_holds(scaled.err, {"scaled.txt"});
  std::ofstream(out_ / "nan.txt") << "0 nan 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n";
  EXPECT_EQ(audit(out_ / "nan.txt").status, 2);
  std::ofstream(out_ / "other.txt") << "70 0 0 0 0 0 0 1\n71 0 0 0 0 0 0 1\n";
  EXPECT_EQ(audit(out_ / "other.txt").status, 2);
}

}  // namespace
}  // namespace gpureg::test
