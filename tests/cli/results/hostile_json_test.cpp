// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

using nlohmann::json;

/// JSON documents that exhaust the stack or the time of a careless reader.
class HostileJson : public ::testing::Test {
 protected:
  HostileJson() {
    truth_.write("gt.log", "0 2 3\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    truth_.write("gt.info", "0 2 3\n" + six_rows());
    write_scans(scans_, 2, false);
  }

  static std::string six_rows() {
    std::string text;
    for (int row = 0; row < 6; ++row)
      for (int column = 0; column < 6; ++column)
        text += std::string(row == column ? "100" : "0") + (column < 5 ? " " : "\n");
    return text;
  }

  static std::string pair(int i, int j, const std::string& ms) {
    return "{\"i\":" + std::to_string(i) + ",\"j\":" + std::to_string(j) +
           R"(,"status":"aligned","reason":"none","confidence":1,)"
           R"("T_ij":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"ms":{"total":1)" +
           ms + "}}";
  }

  /// Processor time of all commands so far.
  static long seconds_of_commands() {
    rusage usage{};
    getrusage(RUSAGE_CHILDREN, &usage);
    return usage.ru_utime.tv_sec;
  }

  /// The verbs that read a result, with what else they need.
  std::vector<std::vector<std::string>> readers(const std::string& result) const {
    return {
        {"report", result, "-o", out_ / "r.html"},
        {"consistency", result, "--json", out_ / "a.json", "--voxel-size", "0.1"},
        {"evaluate", result, "--ground-truth", truth_.path()},
        joined({"reconstruct", scans_.path(), "-o", out_ / "map", "--results", result}, kSmall)};
  }

  const TemporaryFolder truth_, scans_, out_;
};

TEST_F(HostileJson, DeepDocumentsAreRefused) {
  constexpr std::size_t kDeep = 200'000;
  for (const auto& [open, close] : {std::pair("[", "]"), std::pair("{\"a\":", "}")}) {
    std::string deep;
    for (std::size_t k = 0; k < kDeep; ++k) deep += open;
    deep += "0";
    for (std::size_t k = 0; k < kDeep; ++k) deep += close;
    for (const std::string& text :
         {"{\"pairs\":[" + pair(0, 1, ",\"x\":" + deep) + "]}",
          "{\"options\":" + deep + ",\"pairs\":[" + pair(0, 1, "") + "]}"}) {
      const std::string result = out_.write("deep.json", text);
      for (const auto& arguments : readers(result))
        expect_refused(arguments, {result, "nested more than 64 deep"});
    }
    const std::string calibration =
        out_.write("deep.json", "{\"gpureg\":\"calibration\",\"slope\":" + deep + "}");
    expect_refused(joined({"register", scans_ / "cloud_bin_0.ply", scans_ / "cloud_bin_1.ply",
                           "--calibration", calibration},
                          kSmall),
                   {calibration, "nested more than 64 deep"});
  }
}

TEST_F(HostileJson, ManyStagesTakeNoTime) {
  std::string ms;
  for (int k = 0; k < 100'000; ++k) ms += ",\"stage " + std::to_string(k) + "\":1";
  const std::string one = out_.write("one.json", "{\"pairs\":[" + pair(0, 1, ms) + "]}");
  for (const auto& arguments : readers(one))
    expect_refused(arguments, {one, "more than 1000 members"});
  // More names, of many pairs.
  constexpr int kPairs = 400, kStages = 500;
  std::string pairs;
  for (int k = 0; k < kPairs; ++k) {
    ms.clear();
    for (int s = 0; s < kStages; ++s) ms += ",\"s" + std::to_string(kStages * k + s) + "\":1";
    pairs += (k > 0 ? "," : "") + pair(k, k + 1, ms);
  }
  const std::string many = out_.write("many.json", "{\"pairs\":[" + pairs + "]}");
  const auto begin = seconds_of_commands();
  Command command({"report", many, "-o", out_ / "r.html"});
  EXPECT_EQ(command.wait().status, 0);
  // It takes a few seconds; a search through all names for each of them takes minutes.
  EXPECT_LT(seconds_of_commands() - begin, 60);
}

TEST_F(HostileJson, MembersThatStandTwiceAreNamed) {
  const std::string result = out_.write("r.json", R"({"pairs": [], "folder": "a", "folder": "b"})");
  for (const auto& arguments : readers(result))
    expect_refused(arguments, {result, "\"folder\"", "twice"});
}

TEST_F(HostileJson, MessagesAreForPeople) {
  const std::string result = out_.write("r.json", "{\"pairs\": [}");
  for (const auto& arguments : readers(result)) {
    expect_refused(arguments, {result + ": parse error at line 1"});
    EXPECT_EQ(run(arguments).err.find("[json"), std::string::npos);
  }
}

TEST_F(HostileJson, PosesAreRigid) {
  std::string text = pair(0, 1, "");
  text.replace(text.find("[1,0"), 4, "[2,0");
  const std::string result = out_.write("r.json", "{\"pairs\":[" + text + "]}");
  for (const auto& arguments : readers(result))
    expect_refused(arguments, {result, "pairs[0]", "\"T_ij\" is no rigid motion"});
}

}  // namespace
}  // namespace gpureg::test
