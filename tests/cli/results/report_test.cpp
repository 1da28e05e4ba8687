// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "gpureg/evaluation.hpp"

namespace gpureg::test {
namespace {

std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++count;
  return count;
}

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

  std::string page(const std::vector<std::string>& more) const {
    const Outcome outcome = run(joined({"report", result_, "-o", out_ / "report.html"}, more));
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return content_of(out_ / "report.html");
  }

  // Nothing on the page comes from elsewhere, and every element that opens closes.
  static void expect_self_contained(const std::string& html) {
    for (const char* stranger : {"<script", "<link", "http://", "https://", "@import", "url("})
      EXPECT_EQ(html.find(stranger), std::string::npos) << stranger;
    for (const std::string element : {"table", "tr", "td", "svg", "figure", "div", "h2", "details"})
      EXPECT_EQ(occurrences(html, "<" + element + ">") + occurrences(html, "<" + element + " "),
                occurrences(html, "</" + element + ">"))
          << element;
    EXPECT_EQ(html.substr(html.size() - 15), "</body></html>\n");
  }

  const TemporaryFolder scans_, out_;
  const std::string result_ = out_ / "r.json";
};

TEST_F(Report, NumbersAlone) {
  const std::string html = page({});
  expect_self_contained(html);
  expect_holds(
      html, {"voxel size 0.1 &middot;", "quality 5 &middot;",
             "21 pairs of 7 fragments were tried, 10 reported as aligned. 11 are not: ",
             "Preparation, mean per fragment", "Alignment, mean per pair", ">match<", ">features<",
             "Every pair", "too_little_overlap", "Options", ">max_correspondence_distance<",
             "<td>min_confidence</td><td>0.5</td>", "<td>method</td><td>compatibility</td>"});
  EXPECT_EQ(html.find("<img"), std::string::npos);
  EXPECT_EQ(html.find("Recall and precision"), std::string::npos);
}

TEST_F(Report, WithTruthAndPictures) {
  const std::string html = page({"--ground-truth", scans_.path(), "--clouds", scans_.path()});
  expect_self_contained(html);
  expect_holds(html, {"Recall and precision", "R@P95", "polyline", "Pictures of pairs",
                      "<b class=\"correct\">Correct</b>",
                      "<b class=\"false\">False positive</b> &middot; fragment 4 onto 1"});
  EXPECT_EQ(occurrences(html, "data:image/png;base64,iVBORw0KGgo"),
            3u);  // two correct ones, one false positive
  // j - i > 1: six pairs of the room are evaluated, one of them against a false ground truth.
  EXPECT_EQ(occurrences(html, "<td>correct</td>"), 5u);
  EXPECT_EQ(occurrences(html, "<td>false positive</td>"), 1u);
}

TEST_F(Report, MissedPairsAndPicturesWithoutTruth) {
  auto json = json_of(result_);
  for (auto& pair : json["pairs"])
    if (pair["i"] == 0 && pair["j"] == 2) {
      pair["status"] = "not_aligned";
      pair["reason"] = "confidence_too_low";
    }
  out_.write("r.json", json.dump());
  const std::vector<std::string> clouds = {"--clouds", scans_.path()};
  expect_holds(page(joined(clouds, {"--ground-truth", scans_.path()})),
               {"<b class=\"missed\">Missed</b> &middot; fragment 2 onto 0",
                "the best candidate is correct", "<td>missed</td>"});
  expect_holds(page(clouds), {">Aligned</b>", ">Not aligned</b>"});
}

TEST_F(Report, TextsAreEscaped) {
  auto json = json_of(result_);
  json["folder"] = "a<b>&\"c\"";
  json["pairs"][0]["status"] = "not_aligned";
  json["pairs"][0]["reason"] = "<img src=x>";
  out_.write("r.json", json.dump());
  const std::string html = page({});
  expect_holds(html, {"a&lt;b&gt;&amp;&quot;c&quot;", "&lt;img src=x&gt;"});
  EXPECT_EQ(html.find("<img"), std::string::npos);
}

TEST_F(Report, ResultsOfOtherProgramsMayTellLess) {
  out_.write("r.json",
             R"({"pairs": [{"i": 0, "j": 2, "status": "aligned", "reason": "none", "score": 2,
    "T_ij": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1], "ms": {"total": 3}}], "fragments": 3, "options": []})");
  expect_self_contained(page({"--ground-truth", scans_.path()}));
  out_.write("r.json", R"({"pairs": []})");
  expect_self_contained(page({"--ground-truth", scans_.path(), "--clouds", scans_.path()}));
}

TEST_F(Report, ComparesSeveralResults) {
  auto json = json_of(result_);
  json["pairs"].erase(json["pairs"].begin(), json["pairs"].begin() + 5);
  const std::string fewer = out_.write("fewer.json", json.dump());
  const std::string html = page({fewer, "--ground-truth", scans_.path(), "--clouds", scans_.path(),
                                 "--clouds", "-", "--name", "all <pairs>", "--name", "fewer"});
  expect_self_contained(html);
  expect_holds(html, {"gpureg: 2 results", "Comparison", "R@P95", "ms per pair",
                      "<a href=\"#result-1\">all &lt;pairs&gt;</a>",
                      "<h1 class=\"result\" id=\"result-2\">fewer</h1>", "strict rule"});
  EXPECT_EQ(occurrences(html, "data:image/png"), 3u) << "pictures of the first result alone";
  EXPECT_EQ(occurrences(html, "Every pair"), 2u);
  // Without ground truth: no scores, and the paths tell the results apart.
  const std::string plain = page({fewer});
  expect_self_contained(plain);
  expect_holds(plain, {"Comparison", ">" + result_ + "</a>", ">" + fewer + "</a>"});
  EXPECT_EQ(plain.find("R@P95"), std::string::npos);
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
