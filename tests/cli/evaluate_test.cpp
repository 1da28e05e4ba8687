// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "gpureg/evaluation.hpp"

namespace gpureg::test {
namespace {

using nlohmann::json;

/// A truth of four pairs with unit poses, and results written by hand.
class Evaluate : public ::testing::Test {
 protected:
  Evaluate() {
    std::vector<evaluation::LogEntry> log;
    std::vector<evaluation::InformationEntry> information;
    for (int j = 2; j < 6; ++j) {
      log.push_back({0, j, 9, Eigen::Matrix4d::Identity()});
      information.push_back({0, j, 9, 100 * Eigen::Matrix<double, 6, 6>::Identity()});
    }
    evaluation::write_log(truth_ / "gt.log", log);
    evaluation::write_information(truth_ / "gt.info", information);
  }

  // A record as `batch` writes it; wrong: a metre from the truth.
  static json pair(int i, int j, double score, bool aligned, bool wrong) {
    json pose = {1, 0, 0, wrong ? 1 : 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    return {{"i", i},
            {"j", j},
            {"score", score},
            {"status", aligned ? "aligned" : "not_aligned"},
            {"T_ij", pose},
            {"reason", aligned ? "none" : "inlier_ratio_too_low"},
            {"ms", {{"total", 2.5}}}};
  }

  std::string write(const json& pairs) const {
    return out_.write("r.json", json{{"pairs", pairs}}.dump());
  }

  Outcome evaluate(const std::string& result) const {
    return run({"evaluate", result, "--ground-truth", truth_.path(), "--json", out_ / "e.json"});
  }

  void expect_bad(const std::string& content, std::initializer_list<std::string> fragments) {
    const std::string path = out_.write("bad.json", content);
    for (const std::string verb : {"evaluate", "report"}) {
      std::vector<std::string> arguments = {verb, path, "--ground-truth", truth_.path()};
      if (verb == "report") arguments.insert(arguments.end(), {"-o", out_ / "page.html"});
      expect_refused(arguments, {path});
      expect_refused(arguments, fragments);
    }
    EXPECT_FALSE(std::filesystem::exists(out_ / "page.html"));
  }

  const TemporaryFolder truth_, out_;
};

TEST_F(Evaluate, RecallAtPrecisionAndAveragePrecision) {
  // By score: right, right, wrong, right, then the last true pair rejected though its pose is
  // right, and a neighbour.
  const std::string path = write({pair(0, 2, 0.9, true, false), pair(0, 3, 0.8, true, false),
                                  pair(1, 7, 0.7, true, true), pair(0, 4, 0.6, true, false),
                                  pair(0, 5, 0.2, false, false), pair(4, 5, 0.95, true, true)});
  const Outcome outcome = evaluate(path);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"strict", "recall  precision", "R@P50", "R@P99", "AP"});
  const json strict = json_of(out_ / "e.json")["scenes"][0]["strict"];
  EXPECT_EQ(strict["good"], 3);
  EXPECT_EQ(strict["reported"], 4);
  EXPECT_EQ(strict["ground_truth"], 4);
  EXPECT_EQ(strict["recall"], 0.75);
  EXPECT_EQ(strict["precision"], 0.75);
  EXPECT_EQ(strict["raw_recall"], 1.0);
  // Precision along the ranking: 1, 1, 2/3, 3/4, 4/5; recall there: 1/4, 1/2, 1/2, 3/4, 1.
  EXPECT_EQ(strict["recall_at_precision"]["50"], 1.0);
  EXPECT_EQ(strict["recall_at_precision"]["80"], 1.0);
  EXPECT_EQ(strict["recall_at_precision"]["95"], 0.5);
  EXPECT_EQ(strict["recall_at_precision"]["99"], 0.5);
  EXPECT_NEAR(strict["average_precision"].get<double>(), (1 + 1 + 0.75 + 0.8) / 4, 1e-12);
  EXPECT_EQ(json_of(out_ / "e.json")["scenes"][0]["ms"]["pair"], 2.5);
}

TEST_F(Evaluate, TheGeometricRuleWhereTheTruthAllowsIt) {
  const std::string path = write({pair(0, 2, 0.9, true, false), pair(1, 7, 0.7, true, false)});
  expect_holds(evaluate(path).out, {"strict"});
  EXPECT_FALSE(json_of(out_ / "e.json")["scenes"][0].contains("geometric"));
  auto log = evaluation::read_log(truth_ / "gt.log");
  auto information = evaluation::read_information(truth_ / "gt.info");
  log.push_back({1, 7, 9, Eigen::Matrix4d::Identity()});
  information.push_back({1, 7, 9, information[0].information});
  evaluation::write_log(truth_ / "gt_all.log", log);
  evaluation::write_information(truth_ / "gt_all.info", information);
  expect_holds(evaluate(path).out, {"strict", "geometric"});
  const json scene = json_of(out_ / "e.json")["scenes"][0];
  EXPECT_EQ(scene["strict"]["precision"], 0.5);
  EXPECT_EQ(scene["geometric"]["precision"], 1.0);
}

TEST_F(Evaluate, LogsHaveNoRanking) {
  const std::string path = out_ / "r.log";
  evaluation::write_log(path, {{0, 2, 9, Eigen::Matrix4d::Identity()}});
  const Outcome outcome = evaluate(path);
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.out.find("R@P"), std::string::npos);
  EXPECT_EQ(json_of(out_ / "e.json")["scenes"][0]["strict"]["recall"], 0.25);
}

TEST_F(Evaluate, AnEmptyResultHasNoRecall) {
  EXPECT_EQ(evaluate(write(json::array())).status, 0);
  EXPECT_EQ(json_of(out_ / "e.json")["scenes"][0]["strict"]["recall"], 0.0);
  EXPECT_EQ(evaluate(out_.write("r.log", "")).status, 0);
}

TEST_F(Evaluate, FilesThatAreNoResults) {
  expect_bad("{", {": parse error at line 1"});
  expect_bad("{\"pairs\": 3}", {"no array \"pairs\""});
  expect_bad("{\"pairs\": [7]}", {"pairs[0]", "no object"});
  const json good = pair(0, 2, 0.9, true, false);
  const auto with = [&](const char* name, const json& value) {
    json bad = good;
    bad[name] = value;
    return json{{"pairs", {good, bad}}}.dump();
  };
  for (const char* name : {"i", "j", "status", "reason", "score", "T_ij", "ms"}) {
    json lacking = good;
    lacking.erase(name);
    expect_bad(json{{"pairs", {good, lacking}}}.dump(), {"pairs[1]", name});
  }
  expect_bad(with("i", -1), {"pairs[1]", "\"i\"", "-1"});
  expect_bad(with("j", 2.5), {"pairs[1]", "\"j\"", "2.5"});
  expect_bad(with("j", 4294967298), {"pairs[1]", "4294967298"});
  expect_bad(with("status", 1), {"pairs[1]", "\"status\""});
  expect_bad(with("score", "high"), {"pairs[1]", "\"score\"", "high"});
  expect_bad(with("T_ij", nullptr), {"pairs[1]", "aligned", "null"});
  expect_bad(with("T_ij", {1, 2, 3}), {"pairs[1]", "16 numbers"});
  expect_bad(with("ms", 3), {"pairs[1]"});
  expect_bad("{\"pairs\": [" + good.dump().replace(good.dump().find("0.9"), 3, "1e999") + "]}",
             {"number overflow", "1e999"});
}

TEST_F(Evaluate, LogsAndTruthsThatAreWrong) {
  const std::string result = out_ / "r.log";
  evaluation::write_log(result, {{0, 2, 9, Eigen::Matrix4d::Identity()}});
  const auto against = [](const std::string& r, const std::string& t) {
    return std::vector<std::string>{"evaluate", r, "--ground-truth", t};
  };
  expect_refused(against(out_ / "none.log", truth_.path()), {"none.log", "No such file"});
  expect_refused(against(result, out_.path()), {"gt.log", "No such file"});
  expect_refused({"evaluate", result, result, "--ground-truth", truth_.path()},
                 {"1 folders", "2 results"});
  const std::string torn = out_.write("torn.log", "0 2 9\n1 0 0 0\n0 1 0 0\n");
  expect_refused(against(torn, truth_.path()), {torn});
  const std::string nan = out_.write("nan.log", "0 2 9\n1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  expect_refused(against(nan, truth_.path()), {nan, "nan"});
  truth_.write("gt.info", "");
  expect_refused(against(result, truth_.path()), {"gt.info"});
}

}  // namespace
}  // namespace gpureg::test
