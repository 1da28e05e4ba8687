// SPDX-License-Identifier: BSD-3-Clause
// No verb writes over a file that it reads, whatever option names either.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "gpureg/evaluation.hpp"

namespace gpureg::test {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

/// A run of a verb: its arguments but for the outputs, its files and folders to read, and the
/// options that name a file to write.
struct Row {
  Words arguments, inputs, outputs;
};

/// Three scans of the room and everything that is made of them.
class SameFile : public testing::Test {
 protected:
  SameFile() {
    for (const char* name : {"scans", "truth", "map", "new"}) fs::create_directory(folder / name);
    std::string poses, trajectory;
    std::vector<evaluation::LogEntry> log;
    std::vector<evaluation::InformationEntry> information;
    for (int k = 0; k < 3; ++k) {
      const std::string number = std::to_string(k);
      write_cloud(folder, "scans/cloud_bin_" + number + ".ply", room_scan(k));
      poses += number + "\n" + text_of(scan_from_room(k).inverse().matrix());
    }
    log.push_back({0, 2, 3, (scan_from_room(0) * scan_from_room(2).inverse()).matrix()});
    information.push_back({0, 2, 3, 100 * Eigen::Matrix<double, 6, 6>::Identity()});
    for (const std::string where : {"truth/gt", "truth/gt_all"}) {
      evaluation::write_log(folder / (where + ".log"), log);
      evaluation::write_information(folder / (where + ".info"), information);
    }
    folder.write("scans/cameras.txt", "0 0 0 0 0 0 0 0 1\n");
    folder.write("scans/poses.txt", poses);
    folder.write("initial.txt", text_of(log[0].transform));
    folder.write("pose.txt", text_of(scan_from_room(2).inverse().matrix()));
    folder.write("odometry.txt", poses);
    folder.write("pairs.txt", "0 1\n0 2\n1 2\n");
    run(joined({"calibrate", folder / "scans", "--self-pairs", "4", "-o", folder / "made.json"},
               kSmall));
    auto calibration = json_of(folder / "made.json");
    calibration["clouds"] = {7};  // of another scene
    calibration["decided_pairs"] = {{"confidence", {0.9, 0.4}}, {"correct", {true, false}}};
    folder.write("calibration.json", calibration.dump());
    make(
        {"batch", folder / "scans", "-o", folder / "result.log", "--json", folder / "result.json"});
    make({"reconstruct", folder / "scans", "-o", folder / "map"});
    make({"locate", folder / "scans", "--save-map", folder / "saved.gpureg"});
  }

  static std::string text_of(const Eigen::Matrix4d& pose) {
    std::ostringstream text;
    text.precision(17);
    text << pose << "\n";
    return text.str();
  }

  void make(const Words& arguments) const {
    const Outcome outcome = run(joined(arguments, kSmall));
    ASSERT_EQ(outcome.status, 0) << arguments.front() << ": " << outcome.err;
  }

  /// Every verb that writes, with every option that names a file.
  std::vector<Row> rows() const {
    const auto in = [&](const std::string& name) { return folder / name; };
    const std::string scan = in("scans/cloud_bin_0.ply"), other = in("scans/cloud_bin_1.ply");
    const Words calibration = {"--calibration", in("calibration.json")};
    std::vector<Row> rows = {
        {joined({"register", scan, other, "--initial", in("initial.txt")}, calibration),
         {scan, other, in("initial.txt"), in("calibration.json")},
         {"--json", "--overlay", "--image"}},
        {joined({"batch", in("scans"), "--pairs", in("pairs.txt")}, calibration),
         {in("scans"), in("pairs.txt"), in("calibration.json")},
         {"--output", "--info", "--json"}},
        {{"consistency", in("result.json")}, {in("result.json")}, {"--json", "--output"}},
        {{"audit", in("scans"), in("scans/poses.txt")},
         {in("scans")},
         {"--json", "--page", "--mend"}},
        {{"audit", in("scans"), in("map/trajectory.txt")},
         {in("scans"), in("map/trajectory.txt")},
         {"--json", "--page", "--mend"}},
        {{"calibrate", in("scans"), "--trajectory", in("odometry.txt"), "--self-pairs", "4",
          "--max-risk", "0.5", "--scenes", in("calibration.json")},
         {in("scans"), in("odometry.txt"), in("calibration.json")},
         {"--output"}},
        {{"evaluate", in("result.json"), "--ground-truth", in("truth"), "--registration-recall",
          in("truth/gt.log")},
         {in("result.json"), in("truth")},
         {"--json"}},
        {{"evaluate-trajectory", in("odometry.txt"), "--ground-truth", in("scans/poses.txt")},
         {in("odometry.txt"), in("scans/poses.txt")},
         {"--json"}},
        {{"evaluate-surface", scan, "--surface", other, "--trajectory", in("odometry.txt"),
          "--ground-truth", in("scans/poses.txt")},
         {scan, other, in("odometry.txt"), in("scans/poses.txt")},
         {"--json"}},
        {{"report", in("result.json"), "--ground-truth", in("truth"), "--clouds", in("scans")},
         {in("result.json"), in("truth"), in("scans")},
         {"--output"}},
    };
    const std::vector<std::pair<std::string, Words>> maps = {
        {in("scans"), {in("scans")}},
        {in("map"), {in("map"), in("scans")}},
        {in("saved.gpureg"), {in("saved.gpureg")}},
        {other, {other}}};
    for (const auto& [map, files] : maps) {
      rows.push_back({{"locate", scan, map}, joined(files, {scan}), {"--json", "--save-map"}});
      rows.push_back({{"change", scan, map, "--pose", in("pose.txt")},
                      joined(files, {scan, in("pose.txt")}),
                      {"--json", "--scan-ply", "--map-ply"}});
    }
    rows.push_back({{"change", scan, in("saved.gpureg")},
                    {scan, in("saved.gpureg")},
                    {"--json", "--scan-ply", "--map-ply"}});
    // A scan that is a folder.
    rows.push_back(
        {{"locate", in("scans"), in("saved.gpureg")}, {in("scans")}, {"--json", "--save-map"}});
    rows.push_back({{"change", in("scans"), in("saved.gpureg"), "--pose", in("pose.txt")},
                    {in("scans")},
                    {"--json", "--scan-ply", "--map-ply"}});
    return rows;
  }

  /// The arguments with every output at a new place, but for one of them.
  Words with_outputs(const Row& row, const std::string& chosen = "",
                     const std::string& path = "") const {
    Words words = row.arguments;
    for (const std::string& option : row.outputs)
      words = joined(words, {option, option == chosen ? path : folder / ("new/" + option)});
    const std::set<std::string> without_voxels = {"consistency", "evaluate", "evaluate-trajectory",
                                                  "evaluate-surface", "report"};
    return without_voxels.count(words.front()) ? words : joined(words, kSmall);
  }

  static Words files_of(const Words& paths) {
    Words files;
    for (const std::string& path : paths) {
      if (!fs::is_directory(path)) files.push_back(path);
      if (fs::is_directory(path))
        for (const auto& entry : fs::directory_iterator(path))
          files.push_back(entry.path().string());
    }
    return files;
  }

  const TemporaryFolder folder;
};

TEST_F(SameFile, NoOutputOfAnyVerbIsWrittenOverAnyInput) {
  for (const Row& row : rows()) {
    // The row is one that works.
    const Outcome outcome = run(with_outputs(row));
    EXPECT_TRUE(outcome.status == 0 || outcome.status == 1)
        << row.arguments.front() << ": " << outcome.err;
    for (const std::string& option : row.outputs)
      for (const std::string& input : files_of(row.inputs)) {
        const std::string before = content_of(input);
        expect_refused(with_outputs(row, option, input), {"must name different files", input});
        ASSERT_EQ(content_of(input), before)
            << row.arguments.front() << " " << option << " destroys " << input;
      }
  }
}

TEST_F(SameFile, NoOutputOfAnyVerbIsWrittenOverAnotherOne) {
  const std::string one = folder / "new/one";
  for (const Row& row : rows())
    for (const std::string& option : row.outputs)
      if (option != row.outputs.front()) {
        Row same = row;
        same.arguments = joined(row.arguments, {row.outputs.front(), one});
        same.outputs.erase(same.outputs.begin());
        expect_refused(with_outputs(same, option, one), {"must name different files", one});
      }
}

TEST_F(SameFile, NoFileOfAMapIsWrittenOverAnInput) {
  const Words names = {"poses.txt",  "trajectory.txt",      "edges.log",    "graph.g2o",
                       "map.ply",    "map_1.ply",           "poses_1.txt",  "map.html",
                       "pairs.json", "reconstruction.json", "pairs.journal"};
  const std::vector<std::pair<std::string, std::string>> inputs = {
      {"--odometry", "odometry.txt"},
      {"--pairs", "pairs.txt"},
      {"--calibration", "calibration.json"},
      {"--results", "result.json"}};
  for (const auto& [option, input] : inputs)
    for (const std::string& name : names) {
      // The pairs of a map make another map in its folder.
      if (option == "--results" && (name == "pairs.json" || name == "pairs.journal")) continue;
      const TemporaryFolder out;
      fs::copy(folder / input, out / name);
      expect_refused({"reconstruct", folder / "scans", "-o", out.path(), option, out / name,
                      "--backend", "cpu"},
                     {"must name different files", out / name, option});
      EXPECT_EQ(content_of(out / name), content_of(folder / input)) << option << " " << name;
    }
  expect_refused({"reconstruct", folder / "scans", "-o", folder / "scans"}, {"different folders"});
}

#ifdef GPUREG_HAVE_GENERATOR
TEST_F(SameFile, NoSceneIsWrittenOverItsBuilding) {
  const std::string mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  folder.write("new/generated.txt", "");
  const std::string building = folder.write("new/cloud_bin_0.obj", mesh);
  expect_refused({"generate", folder / "new", "--building", building}, {"--building", building});
  EXPECT_EQ(content_of(building), mesh);
}
#endif

TEST_F(SameFile, TheTestKnowsEveryOptionThatNamesAFile) {
  // Options whose text is no path.
  const std::set<std::string> words = {"--voxel-size",
                                       "--preset",
                                       "--backend",
                                       "--set",
                                       "--up",
                                       "--source-up",
                                       "--target-up",
                                       "--near",
                                       "--source-viewpoint",
                                       "--viewpoint",
                                       "--target-viewpoint",
                                       "--name",
                                       "--format",
                                       "--delta-unit"};
  std::map<std::string, std::set<std::string>> known;
  for (const Row& row : rows()) {
    known[row.arguments.front()].insert(row.arguments.begin(), row.arguments.end());
    known[row.arguments.front()].insert(row.outputs.begin(), row.outputs.end());
  }
  known["reconstruct"] = {"--output", "--odometry", "--pairs", "--calibration", "--results"};
  for (const auto& [verb, options] : known) {
    std::istringstream help(run({verb, "--help"}).out);
    for (std::string line; std::getline(help, line);) {
      // As "  -o,--output TEXT REQUIRED".
      const std::size_t begin = line.find("--"), end = line.find(" TEXT");
      if (begin == std::string::npos || end == std::string::npos || line.find(' ', begin) != end)
        continue;
      const std::string option = line.substr(begin, end - begin);
      EXPECT_TRUE(words.count(option) + options.count(option)) << verb << " " << option;
    }
  }
}

}  // namespace
}  // namespace gpureg::test
