// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

namespace fs = std::filesystem;

/// What people call their scans, in natural order.
const std::vector<std::string> kNames = {"a, \"b\" & c.ply", "kitchen north.ply",
                                         "K\xC3\xBC"
                                         "che <b>.ply",
                                         "Scan 2.PLY", "scan 10.ply"};
/// Scans with names, and the same scans as cloud_bin_<i>.
class Names : public ::testing::Test {
 protected:
  static constexpr std::size_t kPairs = 10;

  Names() {
    for (std::size_t k = 0; k < kNames.size(); ++k) {
      write_cloud(numbered_, "cloud_bin_" + std::to_string(k) + ".ply",
                  room_scan(static_cast<int>(k)));
      fs::copy(numbered_ / ("cloud_bin_" + std::to_string(k) + ".ply"), scans_ / kNames[k]);
    }
    scans_.write("readme.md", "of the flat");
  }

  std::vector<std::string> batch(const std::string& scans, const std::string& name,
                                 const std::vector<std::string>& more = {}) const {
    return joined(
        joined({"batch", scans, "-o", out_ / (name + ".log"), "--json", out_ / (name + ".json")},
               kSmall),
        more);
  }

  std::vector<std::string> names_of(const nlohmann::json& list) const {
    std::vector<std::string> names;
    for (const auto& entry : list) names.push_back(entry.at("name"));
    return names;
  }

  const TemporaryFolder scans_, numbered_, out_;
};

TEST_F(Names, OfAFolderAreInEveryFileOfAMap) {
  const std::string map = out_ / "map";
  const Outcome outcome = run(joined({"reconstruct", scans_.path(), "-o", map}, kSmall));
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.err, {"note: 1 file that is no cloud is skipped", "readme.md"});
  const auto document = json_of(map + "/reconstruction.json");
  EXPECT_EQ(names_of(document.at("scans")), kNames);
  EXPECT_EQ(document.at("edges").at(0).at("name_i"), kNames[document.at("edges").at(0).at("i")]);
  const auto pairs = json_of(map + "/pairs.json");
  EXPECT_EQ(names_of(pairs.at("fragments")), kNames);
  EXPECT_EQ(pairs.at("pairs").at(0).at("name_j"), kNames[1]);
  const std::string table = content_of(map + "/scans.csv");
  expect_holds(table, {"number,name,file\n0,\"a, \"\"b\"\" & c.ply\",\"", "\n1,kitchen north.ply,",
                       "\n4,scan 10.ply,"});
  const std::string page = content_of(map + "/map.html");
  expect_holds(page, {"K\xC3\xBC"
                      "che \\u003cb>.ply",
                      "a, \\\"b\\\" & c.ply"});
  EXPECT_EQ(page.find("che <b>"), std::string::npos);

  // The poses are those of the same scans by number.
  ASSERT_EQ(run(joined({"reconstruct", numbered_.path(), "-o", out_ / "numbered"}, kSmall)).status,
            0);
  for (const char* file : {"poses.txt", "trajectory.txt", "edges.log", "graph.g2o", "map.ply"})
    EXPECT_TRUE(content_of(map + "/" + file) ==
                content_of(out_ / ("numbered/" + std::string(file))))
        << file;

  // Names count where another scan comes before the others.
  write_cloud(scans_, "0 first.ply", room_scan(9));
  const Outcome audit = run(joined(
      {"audit", scans_.path(), map, "--json", out_ / "audit.json", "--page", out_ / "audit.html"},
      kSmall));
  EXPECT_EQ(audit.status, 0) << audit.err << audit.out;
  expect_holds(audit.out, {"5 with a pose, 1 without", "sound"});
  expect_holds(content_of(out_ / "audit.html"), {"K\xC3\xBC"
                                                 "che &lt;b&gt;.ply"});
  EXPECT_EQ(names_of(json_of(out_ / "audit.json").at("fragments")).front(), "0 first.ply");
  EXPECT_EQ(run(joined({"locate", scans_ / "0 first.ply", map}, kSmall)).status, 0);
}

TEST_F(Names, OfABatchAreBesideItsLogAndInItsReport) {
  const Outcome outcome = run(batch(scans_.path(), "r"));
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"r_scans.csv"});
  expect_holds(content_of(out_ / "r_scans.csv"), {"3,Scan 2.PLY,"});
  ASSERT_EQ(run(batch(numbered_.path(), "n")).status, 0);
  EXPECT_FALSE(fs::exists(out_ / "n_scans.csv"));
  EXPECT_TRUE(content_of(out_ / "r.log") == content_of(out_ / "n.log"));
  ASSERT_EQ(
      run({"report", out_ / "r.json", "--clouds", scans_.path(), "-o", out_ / "r.html"}).status, 0);
  const std::string page = content_of(out_ / "r.html");
  expect_holds(page,
               {R"("i":"kitchen north.ply")", "che \\u003cb>.ply, confidence ", R"("png":")"});
  EXPECT_EQ(page.find("che <b>"), std::string::npos);
}

TEST_F(Names, StandInListsOfPairsCamerasAndPoses) {
  scans_.write("cameras.txt", "kitchen north.ply 0 0 0 0 0 0 0 1\nScan 2.PLY 0 0 0 0 0 0 0 1\n");
  const std::string pairs = out_.write("pairs.txt",
                                       "kitchen north.ply K\xC3\xBC"
                                       "che <b>.ply\nscan 10 0\n");
  const Outcome outcome = run(batch(scans_.path(), "r", {"--pairs", pairs}));
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.err, {"3 of 5 fragments have no camera"});
  const auto json = json_of(out_ / "r.json");
  EXPECT_EQ(json.at("pairs").size(), 2u);
  const auto viewpoint = [&](int k) { return json.at("fragments").at(k).at("viewpoint"); };
  EXPECT_EQ(viewpoint(1), viewpoint(3));
  EXPECT_NE(viewpoint(1), viewpoint(0));
  expect_refused(batch(scans_.path(), "s", {"--pairs", out_.write("bad.txt", "scan 10 cellar\n")}),
                 {"bad.txt:1:", "'scan 10 cellar' names no two scans"});

  std::string poses = "# name tx ty tz qx qy qz qw\ncellar.ply 9 9 9 0 0 0 1\n";
  std::string numbers;
  const auto map = out_ / "map";
  ASSERT_EQ(run(joined({"reconstruct", numbered_.path(), "-o", map}, kSmall)).status, 0);
  std::istringstream lines(content_of(map + "/trajectory.txt"));
  for (std::string line; std::getline(lines, line);)
    if (line.front() != '#')
      poses += kNames[static_cast<std::size_t>(line.front() - '0')] + line.substr(1) + "\n";
  const std::string file = out_.write("named.txt", poses);
  const Outcome audit = run(joined({"audit", scans_.path(), file}, kSmall));
  EXPECT_EQ(audit.status, 0) << audit.err;
  expect_holds(audit.out, {"5 with a pose, 0 without", "sound"});
  EXPECT_EQ(run(joined({"reconstruct", scans_.path(), "-o", out_ / "odometry", "--odometry", file},
                       kSmall))
                .status,
            0);
  EXPECT_EQ(json_of(out_ / "odometry/reconstruction.json").at("islands").size(), 1u);
}

TEST_F(Names, OfPatternsListsAndSubfolders) {
  const auto names = [&](const std::string& scans, const std::vector<std::string>& more = {}) {
    EXPECT_EQ(run(batch(scans, "r", joined({"--restart"}, more))).status, 0);
    return names_of(json_of(out_ / "r.json").at("fragments"));
  };
  EXPECT_EQ(names(scans_ / "*can*"), (std::vector<std::string>{"Scan 2.PLY", "scan 10.ply"}));
  const std::string list = scans_.write("some.lst", "scan 10.ply\nkitchen north.ply North\n");
  EXPECT_EQ(names(list), (std::vector<std::string>{"scan 10.ply", "North"}));
  fs::create_directories(scans_ / "upstairs/left");
  fs::copy(numbered_ / "cloud_bin_0.ply", scans_ / "upstairs/left/bath.ply");
  EXPECT_EQ(names(scans_.path(), {"--recursive"}).back(), "upstairs/left/bath.ply");
  expect_refused(batch(scans_ / "upstairs", "s"),
                 {"has no clouds itself", "left/bath.ply", "--recursive"});
  expect_refused(batch(scans_ / "upstairs/left", "s"), {"one scan, bath.ply", "two"});
  // An output would take the place of a scan.
  expect_refused(joined({"batch", scans_.path(), "-o", scans_ / "scan 10.ply"}, kSmall),
                 {"must name different files"});
}

TEST_F(Names, OfScansThatAreLocatedOneByOne) {
  const std::string room = write_cloud(out_, "room.ply", room_scan(8));
  const Outcome outcome =
      run(joined({"locate", scans_.path(), room, "--json", out_ / "l.json"}, kSmall));
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(names_of(json_of(out_ / "l.json").at("scans")), kNames);
}

/// A journal knows scans by their names: the numbers are places, which others move.
TEST_F(Names, AreWhatAResumedRunKnows) {
  const std::string bad = scans_.write("0 bad.ply", "ply\nnothing");
  const Outcome first = run(batch(scans_.path(), "r"));
  EXPECT_EQ(first.status, 3);
  expect_holds(first.err, {"gpureg: 0 bad.ply is left out", "--resume"});
  expect_holds(first.out, {"unusable   0 bad.ply"});
  fs::remove(bad);
  const Outcome second = run(batch(scans_.path(), "r", {"--resume"}));
  EXPECT_EQ(second.status, 0) << second.err;
  expect_holds(second.err, {"10 of 10 pairs are done already"});
  ASSERT_EQ(run(batch(numbered_.path(), "n")).status, 0);
  EXPECT_TRUE(content_of(out_ / "r.log") == content_of(out_ / "n.log"));

  scans_.write("0 bad.ply", "ply\nnothing");
  ASSERT_EQ(run(batch(scans_.path(), "r")).status, 3);
  fs::remove(bad);
  fs::rename(scans_ / "scan 10.ply", scans_ / "scan 1.ply");
  expect_refused(batch(scans_.path(), "r", {"--resume", "--quiet"}),
                 {"cannot resume", "scan 10.ply is not there any more", "--restart"});
  fs::rename(scans_ / "scan 1.ply", scans_ / "scan 10.ply");
  write_cloud(scans_, "kitchen north.ply", room_scan(9));
  expect_refused(batch(scans_.path(), "r", {"--resume", "--quiet"}),
                 {"cannot resume", "kitchen north.ply is another cloud than before"});
}

}  // namespace
}  // namespace gpureg::test
