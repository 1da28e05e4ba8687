// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <thread>

#include "cli/command.hpp"
#include "cli/scene.hpp"

namespace gpureg::test {
namespace {

class View : public ::testing::Test {
 protected:
  const TemporaryFolder scans_, out_;
};

TEST_F(View, PairsOfABatchByConfidenceWithPictures) {
  write_scans(scans_, 3, true);
  const std::string result = out_ / "r.json", page = result + ".html";
  ASSERT_EQ(run(joined({"batch", scans_.path(), "--quiet", "-o", out_ / "r.log", "--json", result},
                       kSmall))
                .status,
            0);
  const Outcome outcome = run({"view", result, "--print"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out, std::filesystem::absolute(page).string() + "\n");
  std::vector<double> scores;
  std::set<std::string> headings;
  const std::regex caption("fragment \\d+ onto \\d+, confidence ([0-9.]+)");
  const auto shown = data_of(content_of(page));
  for (const auto& picture : shown.at(0).at("pictures")) {
    const std::string text = picture.at("caption");
    std::smatch match;
    ASSERT_TRUE(std::regex_search(text, match, caption)) << text;
    scores.push_back(std::stod(match[1]));
    headings.insert(picture.at("heading"));
    EXPECT_GT(picture.at("png").get<std::string>().size(), 1000u);
  }
  EXPECT_EQ(scores.size(), 10u);  // five clouds
  EXPECT_TRUE(std::is_sorted(scores.rbegin(), scores.rend()));
  EXPECT_EQ(headings, (std::set<std::string>{"Aligned", "Not aligned"}));

  std::filesystem::rename(scans_ / "cloud_bin_0.ply", out_ / "elsewhere.ply");
  EXPECT_EQ(run({"view", result, "--print"}).status, 2) << "a picture lacks its cloud";
  auto written = json_of(result);
  written["folder"] = out_ / "gone";
  out_.write("r.json", written.dump());
  const Outcome without = run({"view", result, "--print"});
  EXPECT_EQ(without.status, 0);
  expect_holds(without.err, {"no pictures", "gone"});
}

TEST_F(View, APair) {
  const std::string source = write_cloud(out_, "door.ply", room_scan(0)),
                    target = write_cloud(out_, "window.ply", room_scan(1)),
                    result = out_ / "pair.json";
  ASSERT_EQ(run(joined({"register", source, target, "--json", result}, kSmall)).status, 0);
  const Outcome outcome = run({"view", result, "--print"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const auto shown = data_of(content_of(result + ".html")).at(0);
  EXPECT_EQ(shown.at("scene"), "door.ply onto window.ply");
  EXPECT_EQ(shown.at("fragment_count"), 2);
  EXPECT_EQ(shown.at("pairs").size(), 1u);
  EXPECT_EQ(shown.at("pictures").at(0).at("heading"), "Aligned");
}

TEST_F(View, AMapOrAPage) {
  expect_refused({"view", out_.path()}, {"map.html", "gpureg reconstruct"});
  const std::string page = out_.write("map.html", "<html>");
  for (const std::string& path :
       {out_.path(), page, out_.write("reconstruction.json", R"({"gpureg": "reconstruct"})")}) {
    const Outcome outcome = run({"view", path, "--print"});
    EXPECT_EQ(outcome.out, std::filesystem::absolute(page).string() + "\n") << outcome.err;
  }
}

TEST_F(View, WhatHasNoPage) {
  expect_refused({"view", out_ / "none.json"}, {"none.json"});
  expect_refused({"view", write_cloud(out_, "a.ply", room_scan(0))}, {"a.ply", "gpureg register"});
  expect_refused({"view", out_.write("l.json", R"({"gpureg": "locate"})")},
                 {"l.json", "gpureg locate", "register, batch"});
  for (const char* text :
       {R"({"gpureg": "register"})", R"({"gpureg": "register", "result": {"status": 3}})",
        R"({"gpureg": "register", "result": {}, "source": "a", "target": []})"})
    expect_refused({"view", out_.write("p.json", text)}, {"p.json"});
}

// The desktop's program gets the page, whatever characters its name has.
TEST_F(View, OpensTheBrowser) {
#ifdef __APPLE__
  GTEST_SKIP() << "macOS has another program";
#endif
  const std::string page = out_.write("my $(map).html", "<html>"), seen = out_ / "seen",
                    program = out_.write("xdg-open", "#!/bin/sh\nprintf %s \"$1\" > '" + seen +
                                                         "'; mv '" + seen + "' '" + seen +
                                                         ".done'; sleep 2\n");
  ASSERT_EQ(::chmod(program.c_str(), 0700), 0);
  const char* const path = std::getenv("PATH");
  ASSERT_NE(path, nullptr);
  const std::string before = path;
  ::setenv("PATH", (out_.path() + ":" + before).c_str(), 1);
  ::setenv("DISPLAY", ":7", 1);
  const auto start = std::chrono::steady_clock::now();
  const Outcome outcome = run({"view", page});
  ::setenv("PATH", before.c_str(), 1);
  ::unsetenv("DISPLAY");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(1900));  // no wait
  for (int k = 0; k < 100 && !std::filesystem::exists(seen + ".done"); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(content_of(seen + ".done"), page);
}

}  // namespace
}  // namespace gpureg::test
