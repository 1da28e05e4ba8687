// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

constexpr int kScans = 6;

class AuditCommand : public ::testing::Test {
 protected:
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
  EXPECT_EQ(document.at("sound"), true);
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

TEST_F(AuditCommand, PosesThatKeepAllScansApartAreNoSoundMap) {
  std::ofstream file(out_ / "apart.txt");
  for (int k = 0; k < kScans; ++k) file << k << " " << 1000 * k << " 0 0 0 0 0 1\n";
  file.close();
  const Outcome outcome = audit(out_ / "apart.txt");
  EXPECT_EQ(outcome.status, 1) << outcome.err;
  expect_holds(outcome.out, {"verdict    undecided", "in the unit of their points?"});
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
