// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "gpureg/evaluation.hpp"

namespace gpureg::test {
namespace {

using nlohmann::json;

/// Results of four fragments in one place, written by hand.
class ConsistencyVerb : public ::testing::Test {
 protected:
  static json pose(double x) { return {1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; }
  static json mode(double x, double confidence) {
    return {{"T_ij", pose(x)},
            {"confidence", confidence},
            {"overlap_confidence", confidence / 2},
            {"evidence", json::object()}};
  }
  static json pair(int i, int j, const json& modes) {
    const double score = modes[0]["confidence"].get<double>();
    return {{"i", i},
            {"j", j},
            {"confidence", score},
            {"status", score >= 0.5 ? "aligned" : "not_aligned"},
            {"reason", score >= 0.5 ? "none" : "confidence_too_low"},
            {"T_ij", modes[0]["T_ij"]},
            {"modes", modes},
            {"ms", {{"total", 2.5}}}};
  }
  /// All right with 0.95, but for 0-1, whose first mode is a metre off, and 2-3, which is weak.
  static json pairs() {
    json out = json::array();
    for (int i = 0; i < 4; ++i)
      for (int j = i + 1; j < 4; ++j) {
        json modes = {mode(0, i == 2 ? 0.3 : 0.95)};
        if (i + j == 1) modes = {mode(1, 0.5), mode(0, 0.1)};
        out.push_back(pair(i, j, modes));
      }
    return out;
  }
  static json document(const json& pairs) {
    return {{"gpureg", "batch"},
            {"options", {{"voxel_size", 0.05}, {"min_confidence", 0.5}}},
            {"pairs", pairs}};
  }
  const TemporaryFolder folder_;
};

TEST_F(ConsistencyVerb, ConsistentLoopsRaiseTheConfidence) {
  const std::string result = folder_.write("r.json", document(pairs()).dump());
  const Outcome outcome =
      run({"consistency", result, "--json", folder_ / "a.json", "-o", folder_ / "a.log"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"1 with another pose", "aligned    6, 5 before"});
  const json out = json_of(folder_ / "a.json")["pairs"];
  const json &swapped = out[0], &weak = out[5];
  EXPECT_EQ(swapped["T_ij"], pose(0));
  EXPECT_EQ(swapped["modes"][0]["T_ij"], pose(0));
  EXPECT_EQ(swapped["modes"][1]["T_ij"], pose(1));
  EXPECT_EQ(swapped["loop_consistency"]["mode"], 1);
  EXPECT_EQ(swapped["loop_consistency"]["confidence_alone"], 0.5);
  EXPECT_GT(weak["confidence"], 0.6);
  EXPECT_EQ(weak["status"], "aligned");
  EXPECT_EQ(weak["reason"], "none");
  EXPECT_NEAR(weak["modes"][0]["overlap_confidence"].get<double>(),
              weak["confidence"].get<double>() / 2, 1e-12);
  const auto log = evaluation::read_log(folder_ / "a.log");
  ASSERT_EQ(log.size(), 6u);
  EXPECT_EQ(log[0].count, 4);
  EXPECT_EQ(log[0].transform, Eigen::Matrix4d::Identity());
}

TEST_F(ConsistencyVerb, TheResultOfABatch) {
  write_scans(folder_, 3, true);
  ASSERT_EQ(run(joined({"batch", folder_.path(), "-o", folder_ / "r.log", "--json",
                        folder_ / "r.json", "--quiet"},
                       kSmall))
                .status,
            0);
  ASSERT_EQ(run({"consistency", folder_ / "r.json", "--json", folder_ / "a.json"}).status, 0);
  const json before = json_of(folder_ / "r.json"), after = json_of(folder_ / "a.json");
  ASSERT_EQ(after["pairs"].size(), before["pairs"].size());
  for (std::size_t k = 0; k < after["pairs"].size(); ++k)
    EXPECT_EQ(after["pairs"][k]["loop_consistency"]["confidence_alone"],
              before["pairs"][k]["confidence"]);
}

TEST_F(ConsistencyVerb, TheSameEvidenceCountsOnce) {
  const std::string result = folder_.write("r.json", document(pairs()).dump());
  ASSERT_EQ(run({"consistency", result, "--json", folder_ / "a.json"}).status, 0);
  const auto expect_refused_again = [&] {
    expect_refused(
        {"consistency", folder_ / "a.json", "--json", folder_ / "b.json"},
        {folder_ / "a.json", "gpureg consistency", "already", "RESULT.json of the batch"});
    EXPECT_FALSE(std::filesystem::exists(folder_ / "b.json"));
  };
  expect_refused_again();
  // Also where a program kept the pairs alone.
  json kept = json_of(folder_ / "a.json");
  kept.erase("loop_consistency");
  folder_.write("a.json", kept.dump());
  expect_refused_again();
}

TEST_F(ConsistencyVerb, RefusesBadVoxelSizes) {
  const std::string result = folder_.write("r.json", document(pairs()).dump());
  for (const std::string size : {"1e9", "0", "-1", "nan", "1e-9"})
    expect_refused({"consistency", result, "--json", folder_ / "a.json", "--voxel-size", size},
                   {"--voxel-size is "});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.json"));
  EXPECT_EQ(
      run({"consistency", result, "--json", folder_ / "a.json", "--voxel-size", "0.05"}).status, 0);
}

TEST_F(ConsistencyVerb, BadInputIsNamed) {
  const auto refused = [&](const json& content, std::initializer_list<std::string> fragments) {
    const std::string path = folder_.write("bad.json", content.dump());
    expect_refused({"consistency", path, "--json", folder_ / "a.json"}, {path});
    expect_refused({"consistency", path, "--json", folder_ / "a.json"}, fragments);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "a.json"));
  };
  json bad = pairs();
  bad[2]["modes"][0]["confidence"] = 1.5;
  refused(document(bad), {"results[2].modes[0].confidence", "1.5"});
  bad = pairs();
  bad[1]["modes"] = 7;
  refused(document(bad), {"pairs[1]", "modes"});
  bad = pairs();
  bad[3]["T_ij"][0] = 7;
  refused(document(bad), {"pairs[3]", "\"T_ij\" is no rigid motion"});
  refused({{"pairs", pairs()}}, {"--voxel-size"});
  const std::string log = folder_.write("r.log", "");
  expect_refused({"consistency", log, "--json", folder_ / "a.json"}, {log, "a log"});
  expect_refused({"consistency", log}, {"--json"});
}

TEST_F(ConsistencyVerb, ADocumentOfANewerFormatIsRefused) {
  json newer = document(pairs());
  newer["format_version"] = 2;
  const std::string result = folder_.write("newer.json", newer.dump());
  expect_refused({"consistency", result, "--json", folder_ / "a.json"},
                 {result, "format version 2", "up to 1"});
  newer["format_version"] = "one";
  const std::string damaged = folder_.write("damaged.json", newer.dump());
  expect_refused({"consistency", damaged, "--json", folder_ / "a.json"},
                 {damaged, "\"format_version\" is \"one\""});
}

TEST_F(ConsistencyVerb, DocumentsSayTheirFormat) {
  const std::string result = folder_.write("r.json", document(pairs()).dump());
  ASSERT_EQ(run({"consistency", result, "--json", folder_ / "a.json"}).status, 0);
  EXPECT_EQ(json_of(folder_ / "a.json")["format_version"], 1);
}

}  // namespace
}  // namespace gpureg::test
