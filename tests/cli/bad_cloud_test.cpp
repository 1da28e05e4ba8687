// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

/// Files that are no clouds: every verb that reads clouds must name the file and say what is wrong
/// with it.
class BadCloud : public ::testing::Test {
 protected:
  void expect_named(const std::string& content, std::initializer_list<std::string> fragments) {
    const std::string bad = scans_.write("cloud_bin_1.ply", content);
    for (const auto& arguments : std::vector<std::vector<std::string>>{
             {"register", bad, good_},
             {"register", good_, bad},
             {"info", good_, bad},
             {"batch", scans_.path(), "-o", scans_ / "result.log"}}) {
      expect_refused(arguments, {bad});
      expect_refused(arguments, fragments);
    }
    EXPECT_EQ(scans_.count(), 2u) << "a run without a result left files behind";
  }

  const TemporaryFolder scans_;
  const std::string good_ = write_cloud(scans_, "cloud_bin_0.ply", room_scan(0));
  const std::string whole_ = content_of(good_);
};

TEST_F(BadCloud, Empty) { expect_named("", {"empty"}); }

TEST_F(BadCloud, Truncated) {
  expect_named(whole_.substr(0, whole_.size() - 1), {"truncated"});
  expect_named(whole_.substr(0, whole_.size() / 2), {"truncated"});
}

TEST_F(BadCloud, MissingFilesAndFolders) {
  const std::string missing = scans_ / "none.ply";
  expect_refused({"register", missing, good_}, {missing, "No such file"});
  expect_refused({"register", good_, missing}, {missing, "No such file"});
  expect_refused({"info", missing}, {missing, "No such file"});
  expect_refused({"register", scans_.path(), good_}, {scans_.path(), "folder"});
  expect_refused({"batch", missing, "-o", scans_ / "r.log"}, {missing, "No such file"});
  const TemporaryFolder empty;
  expect_refused({"batch", empty.path(), "-o", scans_ / "r.log"},
                 {empty.path(), "is empty", "PLY"});
  expect_refused({"batch", scans_.path(), "-o", scans_ / "r.log"},
                 {scans_.path(), "one scan, cloud_bin_0.ply"});
}

TEST_F(BadCloud, CamerasAndPairs) {
  write_cloud(scans_, "cloud_bin_3.ply", room_scan(1));
  const std::string log = scans_ / "r.log";
  const auto batch = [&](const std::string& pairs) {
    return std::vector<std::string>{"batch", scans_.path(), "-o", log, "--pairs", pairs};
  };
  expect_refused(batch(scans_ / "none.txt"), {"none.txt", "No such file"});
  const std::string pairs = scans_.write("pairs.txt", "0 3\n0 2\n");
  expect_refused(batch(pairs), {pairs, "no fragment 2"});
  scans_.write("pairs.txt", "0 3\n3 3\n");
  expect_refused(batch(pairs), {pairs + ":2"});
  scans_.write("pairs.txt", "0 three\n");
  expect_refused(batch(pairs), {pairs + ":1"});
  scans_.write("pairs.txt", "# none\n");
  expect_refused(batch(pairs), {pairs, "no pair"});
  scans_.write("cameras.txt", "0 0 1 2 nan 0 0 0 1\n");
  expect_refused(batch("all"), {"cameras.txt:1"});
}

TEST_F(BadCloud, OfManyTheFileIsNamed) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> millimetres(0, 4000);
  PointCloud lonely;
  for (int k = 0; k < 30000; ++k)
    lonely.points.emplace_back(millimetres(random), millimetres(random), millimetres(random));
  const std::string bad = write_cloud(scans_, "cloud_bin_3.ply", lonely),
                    good = write_cloud(scans_, "cloud_bin_5.ply", room_scan(1));
  const Outcome batch = run({"batch", scans_.path(), "-o", scans_ / "r.log"});
  EXPECT_EQ(batch.status, 3);
  expect_holds(batch.err, {"fragment 3 is left out", bad + ": nearly all of 30000"});
  expect_refused({"register", good, bad, "--voxel-size", "0.05"},
                 {bad + ": nearly all", "are the units different? target is"});
}

}  // namespace
}  // namespace gpureg::test
