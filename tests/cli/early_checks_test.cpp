// SPDX-License-Identifier: BSD-3-Clause
// Every verb looks at all files that it was given before it works on any of them: the clouds here
// are damaged, and the message is not about them.
#include <gtest/gtest.h>

#include <filesystem>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

class EarlyChecks : public testing::Test {
 protected:
  EarlyChecks() {
    for (const char* name : {"cloud_bin_0.ply", "cloud_bin_1.ply"})
      scans_.write(name, "ply\nformat ascii 1.0\nelement vertex 3\nend_header\n");
  }

  /// @param before the option's value.
  void expect_named(const std::vector<std::string>& before, const std::string& damaged,
                    const std::vector<std::string>& after = {}) const {
    const std::string missing = out_ / "missing.txt", bad = out_.write("bad.txt", damaged);
    for (const std::string& file : {missing, bad})
      expect_refused(joined(joined(joined(before, {file}), after), {"--backend", "cpu"}), {file});
  }

  const TemporaryFolder scans_, out_;
  const std::string cloud_ = scans_ / "cloud_bin_0.ply";
};

TEST_F(EarlyChecks, OfPairsAndPoses) {
  const std::string dir = scans_.path(), log = out_ / "r.log", map = out_ / "map",
                    json = out_ / "c.json";
  expect_named({"batch", dir, "-o", log, "--pairs"}, "0 1\n0 x\n");
  expect_named({"batch", dir, "-o", log, "--pairs"}, "0 7\n");
  expect_named({"batch", dir, "-o", log, "--pairs"}, "# none\n");
  expect_named({"batch", dir, "-o", log, "--voxel-size", "auto", "--pairs"}, "0 7\n");
  expect_named({"batch", dir, "-o", log, "--calibration"}, "{}");
  expect_named({"reconstruct", dir, "-o", map, "--pairs"}, "0 7\n");
  expect_named({"reconstruct", dir, "-o", map, "--odometry"}, "0 1 2 3\n");
  expect_named({"reconstruct", dir, "-o", map, "--odometry"}, "7 0 0 0 0 0 0 1\n");
  expect_named({"reconstruct", dir, "-o", map, "--results"}, "{}");
  expect_named({"reconstruct", dir, "-o", map, "--calibration"}, "{}");
  expect_named({"calibrate", dir, "-o", json, "--trajectory"}, "0 1 2 3\n");
  expect_named({"calibrate", dir, "-o", json, "--max-risk", "0.1", "--scenes"}, "{}");
  expect_named({"audit", dir}, "0 1 2 3\n");
  expect_named({"register", cloud_, cloud_, "--initial"}, "0 1 2 3\n");
  expect_named({"register", cloud_, cloud_, "--calibration"}, "{}");
  expect_named({"change", cloud_, cloud_, "--pose"}, "0 1 2 3\n");
  EXPECT_FALSE(std::filesystem::exists(log));
  // Cameras of the folder.
  scans_.write("cameras.txt", "0 0 1 2 nan 0 0 0 1\n");
  expect_refused({"batch", dir, "-o", log, "--voxel-size", "auto"}, {"cameras.txt:1"});
}

TEST_F(EarlyChecks, OfScansBeforeTheMap) {
  // The folder has no poses: it is many scans to be located, and none to be compared.
  expect_refused({"locate", scans_.path(), cloud_}, {scans_ / "cloud_bin_0.ply"});
  expect_refused({"change", scans_.path(), cloud_}, {scans_.path() + " has neither poses.txt"});
  expect_refused({"locate", out_ / "none.ply", cloud_}, {"SCAN", "none.ply"});
  expect_refused({"info", cloud_, out_ / "none.ply"}, {"CLOUD", "none.ply"});
}

TEST_F(EarlyChecks, AModelWithoutNormalsIsNamedWithARemedy) {
  const std::string scan = write_cloud(out_, "scan.ply", room_scan(0)),
                    model = write_cloud(out_, "model.ply", room_scan(1));
  expect_refused({"register", scan, model, "--target-viewpoint", "model"},
                 {"--target-viewpoint model needs normals", model, "give a mesh"});
  expect_refused({"register", scan, model, "--source-viewpoint", "model"},
                 {"--source-viewpoint model needs normals", scan});
  expect_refused({"locate", scan, model, "--viewpoint", "model"}, {"--viewpoint model", scan});
  expect_refused({"change", scan, model, "--viewpoint", "model"}, {"--viewpoint model", scan});
}

TEST_F(EarlyChecks, OfEveryResultBeforeAnyPicture) {
  const std::string good = out_.write("good.json", R"({"pairs": [{"i": 0, "j": 1, "confidence": 0.9,
      "status": "aligned", "reason": "none", "ms": {"total": 1},
      "T_ij": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}]})");
  const std::string bad = out_.write("bad.json", "{\"pairs\": 3}");
  expect_refused({"report", good, bad, "--clouds", scans_.path(), "-o", out_ / "page.html"}, {bad});
}

}  // namespace
}  // namespace gpureg::test
