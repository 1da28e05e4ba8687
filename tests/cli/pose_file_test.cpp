// SPDX-License-Identifier: BSD-3-Clause
// Every verb that reads 4 x 4 poses looks at all 16 numbers.
#include <gtest/gtest.h>

#include <sstream>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

std::string rows_of(const Eigen::Matrix4d& pose) {
  std::ostringstream text;
  text.precision(17);
  text << pose << "\n";
  return text.str();
}

class PoseFile : public testing::Test {
 protected:
  PoseFile() { write_scans(folder_, 2, false); }

  /// Every verb with the pose in a file of every form that it reads.
  void expect_refused_everywhere(const std::string& rows,
                                 std::initializer_list<std::string> fragments) const {
    const std::string a = folder_ / "cloud_bin_0.ply", b = folder_ / "cloud_bin_1.ply",
                      right = rows_of(Eigen::Matrix4d::Identity());
    const std::string pose = out_.write("pose.txt", rows),
                      poses = out_.write("poses.txt", "0\n" + right + "1\n" + rows),
                      log = out_.write("pairs.log", "0 1 2\n" + rows),
                      truth = out_.write("truth.txt", "0\n" + right + "1\n" + right);
    const auto refused = [&](const std::vector<std::string>& arguments) {
      expect_refused(arguments, fragments);
    };
    for (const std::string& file : {pose, log}) {
      refused(joined({"change", a, b, "--pose", file}, kSmall));
      refused(joined({"register", a, b, "--initial", file}, kSmall));
    }
    for (const std::string& file : {poses, log}) {
      refused(joined({"audit", folder_.path(), file}, kSmall));
      refused(
          joined({"reconstruct", folder_.path(), "-o", out_ / "map", "--odometry", file}, kSmall));
    }
    refused(joined({"calibrate", folder_.path(), "-o", out_ / "c.json", "--trajectory", poses},
                   kSmall));
    refused({"evaluate-trajectory", poses, "--ground-truth", truth});
    refused(
        {"evaluate-surface", a, "--surface", b, "--trajectory", poses, "--ground-truth", truth});
    std::filesystem::copy_file(poses, folder_ / "poses.txt");
    refused(joined({"locate", a, folder_.path()}, kSmall));
    refused(joined({"change", folder_.path(), a}, kSmall));
    std::filesystem::remove(folder_ / "poses.txt");
  }

  const TemporaryFolder folder_, out_;
  const Eigen::Matrix4d pose_ =
      (Eigen::Translation3d(3, -2, 1) * scan_from_room(1).rotation()).matrix();
};

TEST_F(PoseFile, ATransposedPoseIsNamed) {
  expect_refused_everywhere(rows_of(pose_.transpose()), {"last row", "looks transposed"});
}

TEST_F(PoseFile, WhatIsNoPoseIsNamed) {
  Eigen::Matrix4d scaled = pose_, mirrored = pose_, projective = pose_;
  scaled.topLeftCorner<3, 3>() *= 1.1;
  mirrored.col(0) *= -1;
  projective(3, 3) = 2;
  expect_refused_everywhere(rows_of(scaled), {"no rigid motion", "determinant 1.331"});
  expect_refused_everywhere(rows_of(mirrored), {"no rigid motion", "determinant -1"});
  expect_refused_everywhere(rows_of(projective), {"last row", "0, 0, 0, 2"});
}

TEST_F(PoseFile, MoreOrLessThanAPoseIsRefused) {
  const std::string scan = folder_ / "cloud_bin_0.ply", rows = rows_of(pose_);
  const auto refused = [&](const std::string& content, std::initializer_list<std::string> words) {
    const std::string file = out_.write("pose.txt", content);
    expect_refused(joined({"change", scan, scan, "--pose", file}, kSmall), words);
  };
  refused(rows + "0.5\n", {"pose.txt"});
  refused(rows + "metres\n", {"pose.txt:5"});
  refused(rows.substr(0, rows.size() - 1) + " metres\n", {"pose.txt:4", "5 fields"});
  refused(rows + rows, {"pose.txt", "2 poses"});
  refused(rows.substr(0, rows.rfind('\n', rows.size() - 2)), {"pose.txt", "ends within"});
  refused("", {"pose.txt", "no pose"});
}

TEST_F(PoseFile, OptionsThatDoNothingWithAGivenPoseAreRefused) {
  const std::string scan = folder_ / "cloud_bin_0.ply",
                    pose = out_.write("pose.txt", rows_of(pose_)), map = out_ / "map.gpureg",
                    initial = out_.write("initial.txt", rows_of(pose_)),
                    poses =
                        out_.write("poses.txt", "0\n" + rows_of(pose_) + "1\n" + rows_of(pose_));
  ASSERT_EQ(run(joined({"locate", scan, "--save-map", map}, kSmall)).status, 0);
  const auto refused = [&](const std::vector<std::string>& arguments,
                           const std::vector<std::vector<std::string>>& options,
                           const std::string& why) {
    for (const std::vector<std::string>& option : options)
      expect_refused(joined(arguments, option), {option.front(), "does nothing", why});
  };
  const std::vector<std::string> seed = {"--seed", "2"}, quality = {"--quality", "3"},
                                 confidence = {"--min-confidence", "0.9"},
                                 near = {"--near", "0,0,0,1"}, up = {"--up", "0,0,1"},
                                 set = {"--set", "accept_symmetry=true"},
                                 json = {"--json", out_ / "r.json"};
  refused({"change", scan, scan, "--pose", pose}, {seed, quality, confidence, near, up, set},
          "--pose");
  refused({"locate", scan, "--save-map", out_ / "m.gpureg"},
          {seed, quality, confidence, near, up, set, json}, "without a scan");
  for (const char* verb : {"locate", "change"})
    refused({verb, scan, map}, {{"--set", "prepare.normal_radius=3"}}, "a saved map is prepared");
  refused({"audit", folder_.path(), poses}, {confidence}, "in an audit");
  refused({"audit", folder_.path(), poses}, {seed, quality}, "without --mend");
  refused({"audit", folder_.path(), poses, "--mend", out_ / "m.txt"}, {confidence}, "in an audit");
  refused({"calibrate", folder_.path(), "-o", out_ / "c.json"}, {confidence}, "in a calibration");
  refused({"register", scan, scan, "--initial", initial, "--ignore-alternatives"}, {seed, quality},
          "--ignore-alternatives");
  refused({"reconstruct", folder_.path(), "-o", out_ / "map", "--no-map"},
          {{"--map-voxel-size", "0.1"}}, "--no-map");
}

}  // namespace
}  // namespace gpureg::test
