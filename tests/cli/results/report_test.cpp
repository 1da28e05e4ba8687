// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "gpureg/evaluation.hpp"

namespace gpureg::test {
namespace {

class Report : public ::testing::Test {
 protected:
  Report() {
    write_scans(scans_, 5, true);
    EXPECT_EQ(
        run(joined({"batch", scans_.path(), "--quiet", "-o", out_ / "r.log", "--json", result_},
                   kSmall))
            .status,
        0);
    // The ground truth: all pairs of the room, one of them with a false pose.
    std::vector<evaluation::LogEntry> log;
    std::vector<evaluation::InformationEntry> information;
    for (int i = 0; i < 5; ++i)
      for (int j = i + 1; j < 5; ++j) {
        Eigen::Matrix4d pose = (scan_from_room(i) * scan_from_room(j).inverse()).matrix();
        if (i == 1 && j == 4) pose(0, 3) += 1;
        log.push_back({i, j, 7, pose});
        information.push_back({i, j, 7, 100 * Eigen::Matrix<double, 6, 6>::Identity()});
      }
    evaluation::write_log(scans_ / "gt.log", log);
    evaluation::write_information(scans_ / "gt.info", information);
  }

  /// The results that the page shows.
  nlohmann::json page(const std::vector<std::string>& more) const {
    const Outcome outcome = run(joined({"report", result_, "-o", out_ / "report.html"}, more));
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const std::string html = content_of(out_ / "report.html");
    expect_self_contained(html);
    return data_of(html);
  }

  const TemporaryFolder scans_, out_;
  const std::string result_ = out_ / "r.json";
};

std::size_t with(const nlohmann::json& list, const char* key, const nlohmann::json& value) {
  return static_cast<std::size_t>(std::count_if(
      list.begin(), list.end(),
      [&](const nlohmann::json& entry) { return entry.contains(key) && entry.at(key) == value; }));
}

TEST_F(Report, NumbersAlone) {
  const auto results = page({});
  ASSERT_EQ(results.size(), 1u);
  const auto& result = results[0];
  EXPECT_EQ(result.at("fragment_count"), 7);
  EXPECT_EQ(result.at("pairs").size(), 21u);
  EXPECT_EQ(with(result.at("pairs"), "aligned", true), 10u);
  EXPECT_EQ(with(result.at("pairs"), "reason", "too_little_overlap") > 0, true);
  const auto& options = result.at("options");
  EXPECT_NEAR(options.at("voxel_size"), 0.1, 1e-6);
  EXPECT_EQ(options.at("quality"), 5);
  EXPECT_EQ(options.at("min_confidence"), 0.5);
  EXPECT_EQ(options.at("method"), "compatibility");
  for (const auto& pair : result.at("pairs")) EXPECT_TRUE(pair.at("ms").contains("match"));
  for (const auto& ms : result.at("fragments")) EXPECT_TRUE(ms.contains("features"));
  EXPECT_FALSE(result.contains("evaluation"));
  EXPECT_TRUE(result.at("pictures").empty());
}

TEST_F(Report, WithTruthAndPictures) {
  const auto result = page({"--ground-truth", scans_.path(), "--clouds", scans_.path()}).at(0);
  const auto& strict = result.at("evaluation").at("strict");
  EXPECT_GT(strict.at("curve").size(), 3u);
  EXPECT_TRUE(strict.at("recall_at_precision").contains("95"));
  const auto& pictures = result.at("pictures");
  ASSERT_EQ(pictures.size(), 3u);
  EXPECT_EQ(with(pictures, "heading", "Correct"), 2u);
  EXPECT_EQ(with(pictures, "heading", "False positive"), 1u);
  EXPECT_EQ(pictures[2].at("caption").get<std::string>().find("fragment 4 onto 1"), 0u);
  for (const auto& picture : pictures)
    EXPECT_EQ(picture.at("png").get<std::string>().find("iVBORw0KGgo"), 0u);
  // j - i > 1: six pairs of the room are evaluated, one of them against a false ground truth.
  EXPECT_EQ(with(result.at("pairs"), "correct", true), 5u);
  for (const auto& pair : result.at("pairs"))
    if (pair.at("i") == "1" && pair.at("j") == "4") {
      EXPECT_EQ(pair.at("correct"), false);
      EXPECT_EQ(pair.at("aligned"), true);
    }
}

TEST_F(Report, MissedPairsAndPicturesWithoutTruth) {
  auto document = json_of(result_);
  for (auto& pair : document["pairs"])
    if (pair["i"] == 0 && pair["j"] == 2) {
      pair["status"] = "not_aligned";
      pair["reason"] = "confidence_too_low";
    }
  out_.write("r.json", document.dump());
  const std::vector<std::string> clouds = {"--clouds", scans_.path()};
  const auto result = page(joined(clouds, {"--ground-truth", scans_.path()})).at(0);
  const auto& missed = result.at("pictures").back();
  EXPECT_EQ(missed.at("heading"), "Missed");
  expect_holds(missed.at("caption"), {"fragment 2 onto 0", "the best candidate is correct"});
  for (const auto& pair : result.at("pairs"))
    if (pair.at("i") == "0" && pair.at("j") == "2") EXPECT_EQ(pair.at("in_truth"), true);
  const auto pictures = page(clouds).at(0).at("pictures");
  EXPECT_GT(with(pictures, "heading", "Aligned"), 0u);
  EXPECT_GT(with(pictures, "heading", "Not aligned"), 0u);
}

// The script sets texts, never HTML; the data cannot end its element.
TEST_F(Report, TextsAreEscaped) {
  auto document = json_of(result_);
  document["folder"] = "a<b>&\"c\"";
  document["pairs"][0]["status"] = "not_aligned";
  document["pairs"][0]["reason"] = "</script><b>bold";
  out_.write("r.json", document.dump());
  const auto result = page({}).at(0);
  EXPECT_EQ(result.at("scene"), "a<b>&\"c\"");
  EXPECT_EQ(result.at("pairs").at(0).at("reason"), "</script><b>bold");
  const std::string html = content_of(out_ / "report.html");
  EXPECT_EQ(html.find("<b>"), std::string::npos);
  EXPECT_EQ(html.find("innerHTML"), std::string::npos);
}

TEST_F(Report, ResultsOfOtherProgramsMayTellLess) {
  out_.write("r.json",
             R"({"pairs": [{"i": 0, "j": 2, "status": "aligned", "reason": "none", "confidence": 2,
    "T_ij": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1], "ms": {"total": 3}}], "fragments": 3, "options": []})");
  EXPECT_EQ(page({"--ground-truth", scans_.path()}).at(0).at("fragment_count"), 0);
  out_.write("r.json", R"({"pairs": []})");
  EXPECT_TRUE(
      page({"--ground-truth", scans_.path(), "--clouds", scans_.path()}).at(0).at("pairs").empty());
}

TEST_F(Report, ComparesSeveralResults) {
  auto document = json_of(result_);
  document["pairs"].erase(document["pairs"].begin(), document["pairs"].begin() + 5);
  const std::string fewer = out_.write("fewer.json", document.dump());
  const auto results = page({fewer, "--ground-truth", scans_.path(), "--clouds", scans_.path(),
                             "--clouds", "-", "--name", "all <pairs>", "--name", "fewer"});
  ASSERT_EQ(results.size(), 2u);
  EXPECT_EQ(results[0].at("name"), "all <pairs>");
  EXPECT_EQ(results[0].at("scene"), results[1].at("scene"));
  EXPECT_EQ(results[0].at("pictures").size(), 3u);
  EXPECT_TRUE(results[1].at("pictures").empty());
  EXPECT_TRUE(results[1].at("evaluation").at("strict").contains("curve"));
  // Without ground truth: no scores, and the paths tell the results apart.
  const auto plain = page({fewer});
  EXPECT_EQ(plain.at(0).at("name"), result_);
  EXPECT_EQ(plain.at(1).at("name"), fewer);
  EXPECT_FALSE(plain.at(0).contains("evaluation"));
  expect_refused({"report", result_, fewer, "-o", out_ / "page.html", "--name", "one"},
                 {"--name was given 1 times for 2 results"});
  expect_refused({"report", result_, "-o", out_ / "page.html", "--ground-truth", scans_.path(),
                  "--ground-truth", scans_.path()},
                 {"--ground-truth was given 2 times for 1 results"});
}

TEST_F(Report, WhatCannotBe) {
  const std::string html = out_ / "page.html";
  expect_refused({"report", out_ / "r.log", "-o", html}, {"r.log", "--json", "this is a log"});
  expect_refused({"report", result_, "-o", out_ / "no/page.html"}, {"no/page.html", "no folder"});
  expect_refused({"report", result_, "-o", html, "--clouds", out_.path()}, {out_.path()});
  std::filesystem::remove(scans_ / "cloud_bin_4.ply");
  expect_refused(
      {"report", result_, "-o", html, "--clouds", scans_.path(), "--ground-truth", scans_.path()},
      {scans_.path(), "no fragment 4"});
  EXPECT_FALSE(std::filesystem::exists(html));
}

}  // namespace
}  // namespace gpureg::test
