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
  EXPECT_EQ(worst.at("scans"), nlohmann::json::parse("[3]"));
  EXPECT_EQ(worst.at("verdict"), "contradicted");
  const std::string page = content_of(out_ / "wrong.html");
  expect_holds(page, {"Contradicted", "Broken at scan 3", "<svg"});
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
