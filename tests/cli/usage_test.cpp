// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

class Usage : public ::testing::Test {
 protected:
  // A run that has all it needs, but for what a test adds.
  std::vector<std::string> with(const std::vector<std::string>& more) const {
    return joined({"register", cloud_, cloud_}, more);
  }

  const TemporaryFolder folder_;
  const std::string cloud_ = write_cloud(folder_, "cloud.ply", room_scan(0));
};

TEST_F(Usage, HelpAndVersionAreNoErrors) {
  for (const char* verb : {"register", "batch", "evaluate", "report", "generate", "info"}) {
    const Outcome help = run({verb, "--help"});
    EXPECT_EQ(help.status, 0);
    EXPECT_EQ(help.err, "");
    expect_holds(help.out, {verb, "Exit status: 0 aligned"});
  }
  const Outcome version = run({"--version"});
  EXPECT_EQ(version.status, 0);
  EXPECT_EQ(version.out.rfind("gpureg ", 0), 0u);
}

TEST_F(Usage, VerbsAndOptionsThatDoNotExist) {
  expect_refused(
      {}, {"no verb",
           "register, batch, consistency, reconstruct, locate, find, change, audit, calibrate, "
           "evaluate, evaluate-trajectory, evaluate-surface, report, view, generate, info"});
  expect_refused({"regsiter", "a", "b"}, {"regsiter", "register, batch"});
  expect_refused({"--bogus"}, {"--bogus"});
  expect_refused(with({"--sed", "3"}), {"--sed", "gpureg register --help"});
  expect_refused(with({"third.ply"}), {"third.ply"});
  expect_refused({"register", cloud_}, {"TARGET"});
  expect_refused({"batch", folder_.path()}, {"--output"});
  expect_refused({"evaluate", "a.log"}, {"--ground-truth"});
  expect_refused(with({"--json"}), {"--json"});
}

TEST_F(Usage, VoxelSizes) {
  expect_refused(with({"--voxel-size", "0"}), {"--voxel-size is 0", "expected"});
  expect_refused(with({"--voxel-size", "nan"}), {"--voxel-size is nan"});
  expect_refused(with({"--voxel-size", "-0.05"}), {"--voxel-size is -0.05"});
  expect_refused(with({"--voxel-size", "inf"}), {"--voxel-size is inf"});
  expect_refused(with({"--voxel-size", "1e30"}), {"--voxel-size is 1e+30"});
  expect_refused(with({"--voxel-size", "1e-30"}), {"--voxel-size is 1e-30"});
  expect_refused(with({"--voxel-size", "1e99"}), {"--voxel-size is inf"});  // no float holds it
  expect_refused(with({"--voxel-size", "5cm"}), {"--voxel-size", "5cm"});
  expect_refused(with({"--voxel-size", ""}), {"--voxel-size is 0"});
  // A good number, but the cloud has more than 2^20 such voxels along an edge.
  PointCloud wide = room_scan(0);
  wide.points.emplace_back(10000.f, 0.f, 0.f);
  expect_refused(
      {"register", write_cloud(folder_, "wide.ply", wide), cloud_, "--voxel-size", "0.002"},
      {"--voxel-size 0.002", "too small"});
}

TEST_F(Usage, AVoxelLargerThanTheCloud) {
  // Five points would be left, which any pose brings together.
  expect_refused(with({"--voxel-size", "1000"}), {"--voxel-size is 1000", cloud_, "extends over"});
  const TemporaryFolder scans;
  write_scans(scans, 2, false);
  expect_refused({"batch", scans.path(), "-o", folder_ / "r.log", "--voxel-size", "1000"},
                 {"--voxel-size is 1000", "extends over"});
}

TEST_F(Usage, OtherValues) {
  expect_refused(with({"--seed", "-4"}), {"--seed", "-4"});
  expect_refused(with({"--seed", "1.5"}), {"--seed", "1.5"});
  expect_refused(with({"--seed", "18446744073709551616"}), {"--seed", "18446744073709551616"});
  const auto hypotheses = [&](const char* count) {
    return with({"--preset", "loopsmart", "--set", std::string("quadruples=") + count});
  };
  expect_refused(hypotheses("0"), {"quadruples is 0"});
  expect_refused(hypotheses("2000000000"), {"quadruples is 2000000000"});
  expect_refused(hypotheses("4e6"), {"--set", "quadruples=4e6", "whole number"});
  expect_refused(hypotheses("4294967297"), {"--set", "4294967297"});
  expect_refused(with({"--set", "prepare.depth_map=3"}),
                 {"--set", "depth_map", "did you mean depth_maps?"});
  expect_refused(with({"--set", "tune=evidence.sample=3"}),
                 {"tune: evidence.sample is 3", "64 to 65536"});
  expect_refused(with({"--threads", "-1"}), {"--threads", "-1"});
  expect_refused(with({"--threads", "two"}), {"--threads", "two"});
  expect_refused(with({"--preset", "fast"}), {"--preset", "fast", "loopsmart"});
  expect_refused(with({"--backend", "gpu"}), {"--backend", "gpu", "cuda"});
  for (const char* score : {"-0.1", "1.01", "nan", "high"}) {
    expect_refused({"batch", folder_.path(), "-o", folder_ / "r.log", "--min-confidence", score},
                   {"--min-confidence", score});
    expect_refused(with({"--min-confidence", score}), {"--min-confidence", score});
  }
}

TEST_F(Usage, ATimeBudgetIsRefusedBeforeTheWork) {
  const std::string none = folder_ / "none.ply";
  for (const char* budget : {"0", "-1", "nan", "inf"})
    expect_refused({"register", none, none, "--time-budget", budget},
                   {"--time-budget is ", budget, "> 0"});
}

TEST_F(Usage, OptionsThatWouldDoNothing) {
  expect_refused(with({"--set", "quadruples=100"}),
                 {"--set quadruples=100", "method compatibility"});
  expect_refused(with({"--preset", "loopsmart", "--set", "accept_symmetry=true"}),
                 {"accept_symmetry=true", "does nothing", "quadruples"});
  expect_refused(with({"--preset", "loopsmart", "--quality", "3"}),
                 {"--quality", "--preset loopsmart"});
  expect_refused(with({"--time-budget", "10", "--quality", "3"}), {"--time-budget", "--quality"});
  expect_refused({"batch", folder_.path(), "-o", folder_ / "r.log", "--set", "quadruples=1"},
                 {"--set quadruples=1", "method compatibility"});
}

TEST_F(Usage, MessagesStayInOneLine) {
  expect_refused({"info", folder_ / "two\nlines.ply"}, {"two lines.ply"});
}

}  // namespace
}  // namespace gpureg::test
