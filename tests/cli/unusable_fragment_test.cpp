// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

/// One fragment of five that cannot be read: it costs its own pairs, and is taken up when it can.
class UnusableFragment : public ::testing::Test {
 protected:
  static constexpr int kScans = 5, kPairs = 10, kOthers = 6;

  UnusableFragment() {
    write_scans(scans_, kScans, false);
    whole_ = content_of(bad_);
  }

  void damage() const { scans_.write("cloud_bin_2.ply", whole_.substr(0, 1000)); }
  void repair() const { scans_.write("cloud_bin_2.ply", whole_); }
  void remove() const { std::filesystem::remove(bad_); }

  std::vector<std::string> batch(const std::string& name,
                                 const std::vector<std::string>& more = {}) const {
    return joined({"batch", scans_.path(), "-o", out_ / (name + ".log"), "--info",
                   out_ / (name + ".info"), "--json", out_ / (name + ".json")},
                  joined(kSmall, more));
  }

  std::vector<std::string> reconstruct(const std::string& name,
                                       const std::vector<std::string>& more = {}) const {
    return joined(joined({"reconstruct", scans_.path(), "-o", out_ / name}, kSmall), more);
  }

  nlohmann::json json(const std::string& name) const { return json_of(out_ / (name + ".json")); }

  void expect_same_batch(const std::string& a, const std::string& b) const {
    for (const char* end : {".log", ".info"})
      EXPECT_TRUE(content_of(out_ / (a + end)) == content_of(out_ / (b + end))) << end;
    EXPECT_TRUE(without_times(json(a)) == without_times(json(b)));
    EXPECT_FALSE(std::filesystem::exists(out_ / (a + ".log.journal")));
  }

  void expect_named(const nlohmann::json& document) const {
    ASSERT_EQ(document.at("unusable").size(), 1u);
    const auto& unusable = document.at("unusable").at(0);
    EXPECT_EQ(unusable.at("number"), 2);
    EXPECT_EQ(unusable.at("file"), "cloud_bin_2.ply");
    expect_holds(unusable.at("reason"), {"truncated"});
  }

  const TemporaryFolder scans_, out_;
  const std::string bad_ = scans_ / "cloud_bin_2.ply";
  std::string whole_;
};

TEST_F(UnusableFragment, OfABatchCostsItsOwnPairs) {
  ASSERT_EQ(run(batch("whole")).status, 0);
  EXPECT_EQ(json("whole").at("unusable").size(), 0u);
  damage();
  const Outcome outcome = run(batch("r"));
  EXPECT_EQ(outcome.status, 3);
  expect_holds(outcome.err, {"fragment 2 is left out", bad_, "truncated", "--resume"});
  expect_holds(outcome.out, {"unusable   2"});
  expect_named(json("r"));
  EXPECT_EQ(json("r").at("complete"), true);
  auto others = without_times(json("whole"));
  for (auto& list : {&others["pairs"], &others["fragments"]})
    for (std::size_t k = list->size(); k-- > 0;)
      for (const char* name : {"i", "j", "number"})
        if (const auto& record = (*list)[k]; record.contains(name) && record[name] == 2) {
          list->erase(k);
          break;
        }
  EXPECT_EQ(others["pairs"].size(), static_cast<std::size_t>(kOthers));
  EXPECT_TRUE(without_times(json("r"))["pairs"] == others["pairs"]);
  EXPECT_TRUE(without_times(json("r"))["fragments"] == others["fragments"]);
  // Readers of the result.
  EXPECT_EQ(run({"consistency", out_ / "r.json", "--json", out_ / "consistent.json"}).status, 0);
  expect_named(json("consistent"));
  EXPECT_EQ(
      run({"report", out_ / "r.json", "--clouds", scans_.path(), "-o", out_ / "r.html"}).status, 0);
}

TEST_F(UnusableFragment, RepairedIsTakenUp) {
  ASSERT_EQ(run(batch("whole")).status, 0);
  damage();
  ASSERT_EQ(run(batch("r")).status, 3);
  expect_refused(batch("r"), {"unfinished", "--resume continues"});
  // Still damaged.
  const Outcome again = run(batch("r", {"--resume"}));
  EXPECT_EQ(again.status, 3);
  expect_holds(again.err, {"6 of 6 pairs are done already"});
  repair();
  const Outcome resumed = run(batch("r", {"--resume"}));
  EXPECT_EQ(resumed.status, 0) << resumed.err;
  expect_holds(resumed.err, {"6 of 10 pairs are done already"});
  EXPECT_EQ(json("r")["seconds"]["pairs_in_this_run"], kPairs - kOthers);
  expect_same_batch("r", "whole");
}

TEST_F(UnusableFragment, RemovedIsForgotten) {
  damage();
  ASSERT_EQ(run(batch("r")).status, 3);
  remove();
  const Outcome resumed = run(batch("r", {"--resume"}));
  EXPECT_EQ(resumed.status, 0) << resumed.err;
  expect_holds(resumed.err, {"6 of 6 pairs are done already"});
  ASSERT_EQ(run(batch("whole")).status, 0);
  expect_same_batch("r", "whole");
}

TEST_F(UnusableFragment, TheAutomaticVoxelSizeStays) {
  const auto automatic = [&](const std::vector<std::string>& more) {
    return joined({"batch", scans_.path(), "-o", out_ / "r.log", "--json", out_ / "r.json",
                   "--voxel-size", "auto", "--quality", "0", "--backend", "cpu"},
                  more);
  };
  damage();
  ASSERT_EQ(run(automatic({})).status, 3);
  const auto before = json("r").at("options");
  remove();
  // A run of these alone would take another one.
  for (const int number : {0, 1})
    write_cloud(scans_, "cloud_bin_" + std::to_string(7 + number) + ".ply", sticks());
  const Outcome resumed = run(automatic({"--resume"}));
  EXPECT_EQ(resumed.status, 0) << resumed.err;
  EXPECT_EQ(json("r").at("options"), before);
}

TEST_F(UnusableFragment, MayBeNamedInFiles) {
  damage();
  const std::string pairs = out_.write("pairs.txt", "0 1\n2 3\n1 3\n2 4\n");
  EXPECT_EQ(run(batch("r", {"--pairs", pairs})).status, 3);
  EXPECT_EQ(json("r").at("pairs").size(), 2u);
  out_.write("pairs.txt", "0 1\n2 9\n");
  const Outcome other = run(batch("other", {"--pairs", pairs}));
  EXPECT_EQ(other.status, 2);
  expect_holds(other.err, {"no fragment 9"});
}

TEST_F(UnusableFragment, NothingIsLeftOfTwo) {
  for (const int number : {0, 1, 3, 4})
    scans_.write("cloud_bin_" + std::to_string(number) + ".ply", "ply");
  expect_refused(batch("r"), {"cloud_bin_0.ply"});
  EXPECT_EQ(out_.count(), 0u);
}

TEST_F(UnusableFragment, OfAMapIsLeftOut) {
  ASSERT_EQ(run(reconstruct("whole")).status, 0);
  damage();
  const Outcome outcome = run(reconstruct("map"));
  EXPECT_EQ(outcome.status, 3) << outcome.err;
  expect_holds(outcome.err, {"fragment 2 is left out", "--resume"});
  expect_holds(outcome.out, {"unusable   2", "placed     4 of 4"});
  expect_named(json_of(out_ / "map/reconstruction.json"));
  expect_named(json_of(out_ / "map/pairs.json"));
  repair();
  const Outcome resumed = run(reconstruct("map", {"--resume"}));
  EXPECT_EQ(resumed.status, 0) << resumed.err;
  expect_holds(resumed.err, {"6 of 10 pairs are done already"});
  for (const char* name : {"poses.txt", "edges.log", "map.ply"})
    EXPECT_TRUE(content_of(out_ / (std::string("map/") + name)) ==
                content_of(out_ / (std::string("whole/") + name)))
        << name;
}

TEST_F(UnusableFragment, OfEarlierResultsAndPosesIsLeftOut) {
  ASSERT_EQ(run(reconstruct("whole")).status, 0);
  damage();
  ASSERT_EQ(run(reconstruct("map")).status, 3);
  const std::string results = out_ / "whole/pairs.json";
  for (const char* more : {"--no-refine", "--no-audit"}) {
    const Outcome outcome = run(reconstruct(more + 2, {"--results", results, more}));
    EXPECT_EQ(outcome.status, 3) << outcome.err;
    expect_named(json_of(out_ / (std::string(more + 2) + "/reconstruction.json")));
  }
  const Outcome audit = run(joined({"audit", scans_.path(), out_ / "whole/poses.txt"}, kSmall));
  EXPECT_EQ(audit.status, 0) << audit.err;
  expect_holds(audit.err, {"fragment 2 is left out"});
}

}  // namespace
}  // namespace gpureg::test
