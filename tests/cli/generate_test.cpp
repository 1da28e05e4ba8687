// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <csignal>
#include <thread>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

#ifdef GPUREG_HAVE_GENERATOR

constexpr const char* kFiles[] = {"cloud_bin_0.ply", "cloud_bin_1.ply", "gt.log",
                                  "gt.info",         "gt_all.log",      "gt_all.info",
                                  "gt_overlap.txt",  "poses.txt",       "cameras.txt"};

std::vector<std::string> generate(const std::string& folder, const std::string& seed) {
  return {"generate", folder, "--fragments", "2", "--frames-per-fragment", "3", "--seed", seed};
}

TEST(Generate, SameSeedSameBytes) {
  const TemporaryFolder out;
  for (const char* name : {"a", "b"}) {
    const Outcome outcome = run(generate(out / name, "5"));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    expect_holds(outcome.out, {"2 fragments of 3 frames written to " + (out / name)});
  }
  for (const std::string file : kFiles) {
    EXPECT_TRUE(std::filesystem::exists(out / ("a/" + file))) << file;
    EXPECT_TRUE(content_of(out / ("a/" + file)) == content_of(out / ("b/" + file))) << file;
  }
  ASSERT_EQ(run(generate(out / "c", "6")).status, 0);
  EXPECT_FALSE(content_of(out / "a/cloud_bin_0.ply") == content_of(out / "c/cloud_bin_0.ply"));
}

TEST(Generate, OtherVerbsReadItsOutput) {
  const TemporaryFolder out;
  const std::string scans = out / "scans", result = out / "r.json";
  ASSERT_EQ(
      run({"generate", scans, "--fragments", "4", "--frames-per-fragment", "4", "--quiet"}).status,
      0);
  const Outcome batch =
      run(joined({"batch", scans, "-o", out / "r.log", "--json", result, "--quiet"}, kSmall));
  EXPECT_LE(batch.status, 1) << batch.err;
  EXPECT_EQ(run({"evaluate", result, "--ground-truth", scans}).status, 0);
  EXPECT_EQ(
      run({"report", result, "--ground-truth", scans, "--clouds", scans, "-o", out / "report.html"})
          .status,
      0);
}

TEST(Generate, WritesIntoNoFolderOfOthers) {
  const TemporaryFolder out, empty;
  const std::string mine = out.write("cloud_bin_0.ply", "a scan of mine");
  expect_refused(generate(out.path(), "5"), {out.path(), "not empty"});
  EXPECT_EQ(content_of(mine), "a scan of mine");
  EXPECT_EQ(out.count(), 1u);
  EXPECT_EQ(run(generate(empty.path(), "5")).status, 0);
  // A scene of its own is replaced, also one that was never finished.
  EXPECT_EQ(run(generate(empty.path(), "6")).status, 0);
  Command killed({"generate", out / "new", "--fragments", "2", "--frames-per-fragment", "50"});
  while (killed.running() && !std::filesystem::exists(out / "new/cloud_bin_0.ply"))
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  killed.send(SIGKILL);
  killed.wait();
  EXPECT_EQ(run(generate(out / "new", "5")).status, 0);
}

TEST(Generate, DepthNoiseIsAFactor) {
  const TemporaryFolder out;
  const auto cloud = [&](const std::string& noise) {
    const std::string folder = out / noise;
    EXPECT_EQ(run({"generate", folder, "--fragments", "1", "--frames-per-fragment", "2", "--quiet",
                   "--depth-noise", noise})
                  .status,
              0);
    return content_of(folder + "/cloud_bin_0.ply");
  };
  const std::string once = cloud("1");
  EXPECT_EQ(run({"generate", out / "default", "--fragments", "1", "--frames-per-fragment", "2",
                 "--quiet"})
                .status,
            0);
  EXPECT_EQ(content_of(out / "default/cloud_bin_0.ply"), once);
  EXPECT_NE(cloud("3"), once);
  expect_refused({"generate", out / "b", "--depth-noise", "11"}, {"--depth-noise", "11"});
}

TEST(Generate, BadValues) {
  const TemporaryFolder out;
  expect_refused({"generate", out / "a", "--fragments", "0"}, {"fragments", "0"});
  expect_refused({"generate", out / "a", "--fragments", "-3"}, {"fragments", "-3"});
  expect_refused({"generate", out / "a", "--frames-per-fragment", "0"},
                 {"frames_per_fragment", "0"});
  expect_refused({"generate", out / "a", "--seed", "-1"},
                 {"--seed", "'-1', expected a whole number, 0 or more"});
  expect_refused({"generate", out / "a", "--seed", "18446744073709551616"},
                 {"--seed", "too large"});
  const std::string file = out.write("file", "mine");
  expect_refused({"generate", file, "--fragments", "2", "--frames-per-fragment", "2"}, {file});
  EXPECT_EQ(content_of(file), "mine");
  expect_refused({"generate", "/proc/gpureg", "--fragments", "2", "--frames-per-fragment", "2"},
                 {"/proc/gpureg"});
}

#else

TEST(Generate, SaysWhyItIsNotThere) {
  expect_refused({"generate", "out", "--fragments", "3"}, {"Embree"});
}

#endif

}  // namespace
}  // namespace gpureg::test
