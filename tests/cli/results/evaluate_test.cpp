// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Geometry>

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

  // One pair more, with too little overlap for the strict rule.
  void write_geometric_truth() const {
    auto log = evaluation::read_log(truth_ / "gt.log");
    auto information = evaluation::read_information(truth_ / "gt.info");
    log.push_back({1, 7, 9, Eigen::Matrix4d::Identity()});
    information.push_back({1, 7, 9, information[0].information});
    evaluation::write_log(truth_ / "gt_all.log", log);
    evaluation::write_information(truth_ / "gt_all.info", information);
  }

  // A record as `batch` writes it; wrong: a metre from the truth.
  static json pair(int i, int j, double score, bool aligned, bool wrong) {
    json pose = {1, 0, 0, wrong ? 1 : 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    return {{"i", i},
            {"j", j},
            {"confidence", score},
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
  write_geometric_truth();
  expect_holds(evaluate(path).out, {"strict", "geometric"});
  const json scene = json_of(out_ / "e.json")["scenes"][0];
  EXPECT_EQ(scene["strict"]["precision"], 0.5);
  EXPECT_EQ(scene["geometric"]["precision"], 1.0);
}

TEST_F(Evaluate, TheStrictRankingGoesByTheChanceOfOverlapToo) {
  // A right pose of a pair that overlaps too little is the surest of all, but says so itself.
  json low = pair(1, 7, 0.99, true, false), listed = pair(0, 2, 0.8, true, false);
  low["modes"] = {{{"overlap_confidence", 0.1}}};
  listed["modes"] = {{{"overlap_confidence", 0.7}}};
  write_geometric_truth();
  ASSERT_EQ(evaluate(write({low, listed})).status, 0);
  json scene = json_of(out_ / "e.json")["scenes"][0];
  EXPECT_EQ(scene["strict"]["recall_at_precision"]["99"], 0.25);
  EXPECT_EQ(scene["strict"]["curve"], (json{{0.25, 1.0}, {0.25, 0.5}}));
  EXPECT_EQ(scene["geometric"]["curve"], (json{{0.0, 1.0}, {0.25, 1.0}}));
  low.erase("modes");
  listed.erase("modes");
  ASSERT_EQ(evaluate(write({low, listed})).status, 0);
  scene = json_of(out_ / "e.json")["scenes"][0];
  EXPECT_EQ(scene["strict"]["recall_at_precision"]["99"], 0.0);
  low["modes"] = {{{"overlap_confidence", "high"}}};
  expect_bad(json{{"pairs", {low}}}.dump(), {"pairs[0]", "overlap_confidence", "high"});
}

TEST_F(Evaluate, NoReportsHaveNoPrecision) {
  const std::string log = out_.write("empty.log", ""), note = " holds no reports";
  Outcome outcome = evaluate(log);
  EXPECT_EQ(outcome.status, 0);
  expect_holds(outcome.out, {"n/a", log + note});
  EXPECT_EQ(outcome.out.find("100.0"), std::string::npos) << outcome.out;
  outcome = evaluate(write(json::array({pair(0, 2, 0.2, false, false)})));
  expect_holds(outcome.out, {"n/a", out_ / ("r.json" + note)});
  outcome = evaluate(write(json::array({pair(0, 2, 0.9, true, true)})));
  expect_holds(outcome.out, {" 0.0"});
  EXPECT_EQ(outcome.out.find("n/a"), std::string::npos) << outcome.out;
  EXPECT_EQ(outcome.out.find(note), std::string::npos) << outcome.out;
}

TEST_F(Evaluate, EveryPairHasItsVerdict) {
  const std::string path = write({pair(0, 2, 0.9, true, false), pair(0, 3, 0.4, false, true),
                                  pair(1, 7, 0.7, true, false), pair(4, 5, 0.9, true, false)});
  const Outcome outcome = evaluate(path);
  expect_holds(outcome.out, {"1 poses of pairs with j - i <= 1 do not count",
                             "2 pairs of the truth were not tried"});
  const json verdicts = json_of(out_ / "e.json")["scenes"][0]["pairs"];
  ASSERT_EQ(verdicts.size(), 5u);  // four of the truth and one that it does not list; no neighbours
  EXPECT_TRUE(verdicts[0]["strict"]);
  EXPECT_EQ(verdicts[0]["error"], 0.0);
  EXPECT_FALSE(verdicts[1]["strict"]);
  EXPECT_FALSE(verdicts[1]["reported"]);
  EXPECT_NEAR(verdicts[1]["error"].get<double>(), 1, 1e-12);
  EXPECT_NEAR(verdicts[1]["metres"].get<double>(), 1, 1e-12);
  EXPECT_NEAR(verdicts[1]["degrees"].get<double>(), 0, 1e-6);
  EXPECT_FALSE(verdicts[2]["tried"]);
  EXPECT_TRUE(verdicts[2]["error"].is_null());
  EXPECT_FALSE(verdicts[4]["known"]);
  EXPECT_TRUE(verdicts[4]["reported"]);
}

// As 3DMatch's users count it: all pairs of the log, neighbours too, whatever was reported.
TEST_F(Evaluate, RegistrationRecall) {
  const auto turned = [](double degrees, double metres) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.rotate(Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitY()));
    pose.translation().x() = metres;
    return pose.matrix();
  };
  const std::string log = out_ / "3dmatch.log";
  evaluation::write_log(log, {{0, 1, 60, turned(14.9, 0)},
                              {0, 2, 60, turned(15.1, 0)},
                              {0, 3, 60, turned(0, 0.31)},
                              {0, 4, 60, turned(0, 0.29)},
                              {0, 5, 60, turned(0, 0)}});
  const std::string result = write({pair(0, 1, 0.1, false, false), pair(0, 2, 0.9, true, false),
                                    pair(0, 3, 0.9, true, false), pair(0, 4, 0.9, true, false)});
  const Outcome outcome = run({"evaluate", result, "--ground-truth", truth_.path(),
                               "--registration-recall", log, "--json", out_ / "e.json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.out, {"registration recall  40.0 % (2 of 5 pairs, 4 tried"});
  EXPECT_EQ(json_of(out_ / "e.json")["scenes"][0]["registration_recall"][0]["right"], 2);
  expect_refused({"evaluate", result, "--ground-truth", truth_.path(), "--registration-recall",
                  out_ / "none.log"},
                 {"none.log"});
}

TEST_F(Evaluate, LogsHaveNoRanking) {
  const std::string path = out_ / "r.log";
  evaluation::write_log(path, {{0, 2, 9, Eigen::Matrix4d::Identity()}});
  const Outcome outcome = evaluate(path);
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.out.find("R@P"), std::string::npos);
  EXPECT_EQ(json_of(out_ / "e.json")["scenes"][0]["strict"]["recall"], 0.25);
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
  for (const char* name : {"i", "j", "status", "reason", "confidence", "T_ij", "ms"}) {
    json lacking = good;
    lacking.erase(name);
    expect_bad(json{{"pairs", {good, lacking}}}.dump(), {"pairs[1]", name});
  }
  expect_bad(with("i", -1), {"pairs[1]", "\"i\"", "-1"});
  expect_bad(with("j", 2.5), {"pairs[1]", "\"j\"", "2.5"});
  expect_bad(with("j", 4294967298), {"pairs[1]", "4294967298"});
  expect_bad(with("status", 1), {"pairs[1]", "\"status\""});
  expect_bad(with("confidence", "high"), {"pairs[1]", "\"confidence\"", "high"});
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

TEST_F(Evaluate, ResultsOfAnotherScene) {
  const auto against = [&](const std::string& path) {
    return std::vector<std::string>{"evaluate", path, "--ground-truth", truth_.path()};
  };
  const std::string log = out_ / "other.log";
  evaluation::write_log(log, {{0, 2, 60, Eigen::Matrix4d::Identity()}});
  expect_refused(against(log), {log + ":1:", "60 fragments", "gt.log", "9"});
  expect_bad(json{{"pairs", {pair(0, 2, 0.9, true, false), pair(0, 9, 0.9, true, false)}}}.dump(),
             {"pairs[1]", "pair 0 9", "out of range", "gt.log"});
  expect_bad(json{{"pairs", {pair(0, 2, 0.9, true, false), pair(0, 2, 0.9, true, false)}}}.dump(),
             {"pairs[1]", "stands twice", "pairs[0]"});
  json missing = {{"fragments", {{{"number", 0}}, {{"number", 2}}}},
                  {"pairs", {pair(0, 2, 0.9, true, false), pair(0, 3, 0.9, true, false)}}};
  expect_bad(missing.dump(), {"pairs[1]", "fragment 3", "lacks"});
}

}  // namespace
}  // namespace gpureg::test
