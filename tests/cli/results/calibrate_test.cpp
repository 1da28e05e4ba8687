// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "cli/command.hpp"
#include "cli/scene.hpp"
#include "gpureg/io.hpp"

namespace gpureg::test {
namespace {

using nlohmann::json;

/// A calibration of scans of a room, and files written by hand.
class CalibrateVerb : public ::testing::Test {
 protected:
  static constexpr int kScans = 10;

  static json good() {
    return {{"format_version", 1},
            {"gpureg", "calibration"},
            {"slope", 0.5},
            {"offset", -1.0},
            {"voxel_size", 0.1}};
  }
  std::string file_with(const char* field, const json& value) const {
    json document = good();
    document[field] = value;
    return folder_.write("bad.json", document.dump());
  }
  std::vector<std::string> calibrate(const std::string& output) const {
    return joined({"calibrate", folder_.path(), "-o", output, "--self-pairs", "32", "--quality",
                   "0", "--quiet"},
                  kSmall);
  }
  std::vector<std::string> registered(const std::string& calibration,
                                      const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {"register", folder_ / "cloud_bin_0.ply",
                                      folder_ / "cloud_bin_1.ply"};
    if (!calibration.empty()) words = joined(words, {"--calibration", calibration});
    return joined(joined(words, kSmall), more);
  }
  static double mapped(double confidence) {
    const double x = -1 + 0.5 * (std::log(confidence) - std::log1p(-confidence));
    return 1 / (1 + std::exp(-x));
  }
  const TemporaryFolder folder_;
};

TEST_F(CalibrateVerb, FromAFolderToTheResults) {
  write_scans(folder_, kScans, false);
  const std::string path = folder_ / "calibration.json";
  const Outcome outcome = run(calibrate(path));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const json document = json_of(path);
  EXPECT_EQ(document["gpureg"], "calibration");
  EXPECT_EQ(document["format_version"], 1);
  EXPECT_EQ(document["enough_samples"], true) << document;
  EXPECT_EQ(document["samples"]["one_scan"]["pairs"], 32);
  EXPECT_EQ(document["samples"]["loop_consistency"]["pairs"], kScans * (kScans - 1) / 2);
  EXPECT_EQ(document["samples"]["trajectory"]["pairs"], 0);
  EXPECT_EQ(document["voxel_size"], 0.1);
  EXPECT_EQ(document["preset"], "default");
  EXPECT_EQ(document["quality"], 0);
  EXPECT_TRUE(document["calibration_error"]["before"].is_number());
  // The same bytes on any number of threads.
  const std::string again = folder_ / "again.json";
  ASSERT_EQ(run(joined(calibrate(again), {"--threads", "3"})).status, 0);
  EXPECT_EQ(json_of(again), document);

  const Outcome result = run(registered(path, {"--json", folder_ / "r.json"}));
  EXPECT_EQ(result.status, 0) << result.err;
  EXPECT_EQ(result.err.find("note"), std::string::npos) << result.err;
  const json options = json_of(folder_ / "r.json")["options"];
  EXPECT_EQ(options["calibration"]["slope"], document["slope"]);
  EXPECT_EQ(options["calibration"]["offset"], document["offset"]);
}

TEST_F(CalibrateVerb, ATrajectoryDecides) {
  write_scans(folder_, kScans, false);
  std::ostringstream lines;
  for (int k = 0; k < kScans + 1; ++k) {  // one more than the folder has
    const Eigen::Isometry3d pose = scan_from_room(k).inverse();
    const Eigen::Quaterniond q(pose.linear());
    const Eigen::Vector3d t = pose.translation();
    lines << k << " " << t.x() << " " << t.y() << " " << t.z() << " " << q.x() << " " << q.y()
          << " " << q.z() << " " << q.w() << "\n";
  }
  const std::string path = folder_ / "calibration.json";
  const std::string trajectory = folder_.write("trajectory.txt", lines.str());
  ASSERT_EQ(run(joined(calibrate(path), {"--trajectory", trajectory})).status, 0);
  const json samples = json_of(path)["samples"];
  EXPECT_EQ(samples["loop_consistency"]["pairs"], 0);
  EXPECT_EQ(samples["trajectory"]["pairs"], kScans * (kScans - 1) / 2);
  EXPECT_GE(samples["trajectory"]["correct"], 20);
  const auto refused = [&](const std::string& text, std::initializer_list<std::string> words) {
    expect_refused(joined(calibrate(path), {"--trajectory", folder_.write("bad.txt", text)}),
                   words);
  };
  refused("100 0 0 0 0 0 0 1\n101 0 0 0 0 0 0 1\n", {"bad.txt", "no poses of two fragments"});
  refused("0.5 0 0 0 0 0 0 1\n", {"bad.txt", "0.5", "number of a fragment"});
  refused("hello\n", {"bad.txt"});
  expect_refused(joined(calibrate(path), {"--trajectory", folder_ / "none.txt"}), {"none.txt"});
}

TEST_F(CalibrateVerb, PromisesARiskOrSaysWhatItTakes) {
  write_scans(folder_, kScans, false);
  const std::string path = folder_ / "calibration.json";
  // Ten scans may prove that at most nine of ten reports are false, and never one of a thousand.
  const Outcome kept = run(joined(calibrate(path), {"--max-risk", "0.9"}));
  ASSERT_EQ(kept.status, 0) << kept.err;
  const json risk = json_of(path)["risk"];
  EXPECT_EQ(risk["supported"], true) << risk;
  EXPECT_EQ(risk["max_risk"], 0.9);
  EXPECT_EQ(risk["scans"], kScans);
  EXPECT_EQ(risk["samples"], json_of(path)["samples"]["loop_consistency"]["samples"]);
  const auto min_confidence = [&](const std::vector<std::string>& more) {
    run(joined(registered(path, {"--json", folder_ / "r.json"}), more));
    return json_of(folder_ / "r.json")["options"]["min_confidence"];
  };
  EXPECT_EQ(min_confidence({}), risk["min_confidence"]);
  EXPECT_EQ(min_confidence({"--min-confidence", "0.25"}), 0.25) << "the user's own goes first";

  const Outcome refused = run(joined(calibrate(path), {"--max-risk", "0.001"}));
  EXPECT_EQ(refused.status, 1);
  expect_holds(refused.err, {"0.1 %", "cannot be promised", "of 10 scans", "more scans would do"});
  EXPECT_EQ(json_of(path)["risk"]["supported"], false);
  EXPECT_FALSE(json_of(path)["risk"].contains("min_confidence"));
  EXPECT_EQ(min_confidence({}), 0.5) << "as without a promise";
  for (const char* bad : {"0", "1", "nan"})
    expect_refused(joined(calibrate(path), {"--max-risk", bad}), {"--max-risk"});
}

TEST_F(CalibrateVerb, PromisesARiskForFurtherScenes) {
  write_scans(folder_, kScans, false);
  const std::string path = folder_ / "calibration.json";
  ASSERT_EQ(run(calibrate(path)).status, 0);
  const json here = json_of(path);
  EXPECT_EQ(here["clouds"].size(), static_cast<std::size_t>(kScans));
  // Pairs of another building of one cloud, as its number.
  const auto scene = [&](int number) {
    json other = good();
    other["decided_pairs"] = {{"confidence", {0.9, 0.4, 0.3}}, {"correct", {true, false, false}}};
    other["options"] = here["options"];
    other["clouds"] = {number};
    return other;
  };
  const auto of_scenes = [&](const std::vector<json>& scenes) {
    std::vector<std::string> words = joined(calibrate(path), {"--max-risk", "0.9"});
    for (std::size_t k = 0; k < scenes.size(); ++k)
      words = joined(words, {"--scenes", folder_.write("other_" + std::to_string(k) + ".json",
                                                       scenes[k].dump())});
    return run(words);
  };
  std::vector<json> scenes;
  for (int k = 0; k < 18; ++k) scenes.push_back(scene(k));
  const Outcome kept = of_scenes(scenes);
  ASSERT_EQ(kept.status, 0) << kept.err;
  const json document = json_of(path), risk = document["risk"];
  EXPECT_EQ(risk["scenes"], 19);
  EXPECT_EQ(risk["samples"], 18 * 3 + document["decided_pairs"]["correct"].size());
  EXPECT_EQ(document["decided_pairs"]["correct"].size(),
            document["samples"]["loop_consistency"]["samples"]);
  const Outcome few = of_scenes({scene(1), scene(2), scene(3)});
  EXPECT_EQ(few.status, 1);
  expect_holds(few.err, {"cannot be promised", "of 4 scenes", "15 more scenes are needed"});
  EXPECT_EQ(json_of(path)["risk"]["more_scenes"], 15);
  expect_refused(joined(calibrate(path), {"--scenes", path}), {"--scenes needs --max-risk"});

  const auto refused = [&](const std::vector<json>& files,
                           std::initializer_list<std::string> words) {
    const Outcome outcome = of_scenes(files);
    EXPECT_EQ(outcome.status, 2);
    expect_holds(outcome.err, words);
  };
  const auto with = [&](const char* field, const json& value) {
    json other = scene(1);
    other[field] = value;
    return other;
  };
  for (const json& bad : {json(), json({{"confidence", {0.9}}}),
                          json({{"confidence", {0.9}}, {"correct", {true, true}}}),
                          json({{"confidence", {"a"}}, {"correct", {true}}})})
    refused({with("decided_pairs", bad)}, {"other_0.json", "decided_pairs"});
  for (const json& bad : {json(), json({1.5}), json(json::array())})
    refused({with("clouds", bad)}, {"other_0.json", "clouds"});
  refused({with("options", json())}, {"other_0.json", "options"});
  // One scene counts once: a file twice, a part of a scene, this folder.
  refused({scene(1), scene(2), scene(1)}, {"other_0.json", "other_2.json", "1 cloud in common"});
  refused({with("clouds", {1, 2, 3}), with("clouds", {7, 3, 2})}, {"2 clouds in common"});
  json self = scene(1);
  self["clouds"] = here["clouds"];
  self["clouds"].erase(0);
  refused({self}, {folder_.path(), "other_0.json", "9 clouds in common"});
  json other = scene(1);
  other["options"]["voxel_size"] = 0.2;
  refused({other}, {"other_0.json", "another --voxel-size"});
  other = scene(1);
  other["options"]["prepare"].erase("depth_maps");
  refused({other}, {"another prepare.depth_maps"});
}

TEST_F(CalibrateVerb, TooFewScansSaySo) {
  write_scans(folder_, 3, false);
  std::vector<std::string> words = calibrate(folder_ / "c.json");
  words.erase(std::find(words.begin(), words.end(), "--quiet"));
  const Outcome outcome = run(words);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_holds(outcome.err, {"too few samples", "changes nothing"});
  expect_holds(outcome.out, {"fragments    3", "of one scan  32 pairs", "slope        1.000"});
  const json document = json_of(folder_ / "c.json");
  EXPECT_EQ(document["enough_samples"], false);
  EXPECT_EQ(document["slope"], 1.0);
  EXPECT_EQ(document["offset"], 0.0);
}

TEST_F(CalibrateVerb, BadUsageIsRefused) {
  write_scans(folder_, 2, false);
  const std::string path = folder_ / "c.json";
  expect_refused({"calibrate", folder_.path(), "-o", path, "--preset", "loopsmart"},
                 {"loopsmart", "confidence"});
  expect_refused({"calibrate", folder_ / "nowhere", "-o", path}, {"nowhere"});
  expect_refused({"calibrate", folder_.path()}, {"output"});
  expect_refused(joined(calibrate(folder_ / "cloud_bin_0.ply"), {}), {"cloud_bin_0.ply"});
  expect_refused(joined(calibrate(path), {"--scan-pairs", "-1"}), {"--scan-pairs"});
  expect_refused(joined(calibrate(path), {"--scan-pairs", "2000000"}), {"scan_pairs"});
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(CalibrateVerb, EveryVerbMapsItsConfidences) {
  write_scans(folder_, 3, false);
  const std::string file = folder_.write("calibration.json", good().dump());
  const auto score_of = [&](const std::vector<std::string>& words, const char* pairs) {
    const Outcome outcome = run(words);
    EXPECT_LE(outcome.status, 1) << outcome.err;  // 1: too little for a map
    const json document = json_of(folder_ / pairs);
    return document.contains("result") ? document["result"]["confidence"].get<double>()
                                       : document["pairs"][0]["confidence"].get<double>();
  };
  const std::vector<std::string> to_json = {"--json", folder_ / "r.json", "--min-confidence", "0"};
  const double plain = score_of(registered("", to_json), "r.json");
  ASSERT_GT(plain, 0.5);
  ASSERT_LT(plain, 1.0);
  EXPECT_NEAR(score_of(registered(file, to_json), "r.json"), mapped(plain), 1e-12);

  const std::string poses = folder_.write("pose.txt", [&] {
    std::ostringstream text;
    text.precision(17);
    text << (scan_from_room(1) * scan_from_room(0).inverse()).matrix();
    return text.str();
  }());
  const std::vector<std::string> verify = joined(to_json, {"--initial", poses});
  EXPECT_NEAR(score_of(registered(file, verify), "r.json"),
              mapped(score_of(registered("", verify), "r.json")), 1e-9);

  std::vector<std::string> batch =
      joined({"batch", folder_.path(), "-o", folder_ / "b.log", "--json", folder_ / "b.json",
              "--quiet", "--min-confidence", "0"},
             kSmall);
  const double of_batch = score_of(batch, "b.json");
  batch = joined(batch, {"--calibration", file});
  EXPECT_NEAR(score_of(batch, "b.json"), mapped(of_batch), 1e-12);
  EXPECT_EQ(json_of(folder_ / "b.json")["options"]["calibration"]["offset"], -1.0);

  std::vector<std::string> map =
      joined({"reconstruct", folder_.path(), "-o", folder_ / "map", "--no-map", "--no-refine",
              "--quiet", "--calibration", file, "--min-confidence", "0"},
             kSmall);
  EXPECT_NEAR(score_of(map, "map/pairs.json"), mapped(of_batch), 1e-12);
  expect_refused(joined(map, {"--results", folder_ / "b.json"}), {"--calibration", "--results"});
}

TEST_F(CalibrateVerb, AnotherVoxelSizeIsSaid) {
  write_scans(folder_, 2, false);
  EXPECT_EQ(run(registered(file_with("voxel_size", 0.12))).err.find("note"), std::string::npos);
  expect_holds(run(registered(file_with("voxel_size", 0.3))).err,
               {"bad.json", "voxel size of 0.3", "this run has 0.1"});
  json promised = good();
  promised["voxel_size"] = 0.3;
  promised["risk"] = {{"min_confidence", 0.4}};
  expect_holds(run(registered(folder_.write("promised.json", promised.dump()))).err,
               {"the promised risk does not hold"});
}

TEST_F(CalibrateVerb, BadFilesAreNamed) {
  write_scans(folder_, 2, false);
  const auto refused = [&](const std::string& path, std::initializer_list<std::string> words) {
    expect_refused(registered(path), words);
  };
  refused(file_with("format_version", 2), {"bad.json", "format version 2", "versions up to 1"});
  refused(file_with("format_version", "x"), {"bad.json", "format_version"});
  refused(file_with("gpureg", "batch"), {"bad.json", "no calibration", "gpureg"});
  for (const json& value : {json(0), json(-1), json(nullptr), json("1"), json(json::array())})
    refused(file_with("slope", value), {"bad.json", "\"slope\" is " + value.dump()});
  for (const json& value : {json(nullptr), json("1"), json(true)})
    refused(file_with("offset", value), {"bad.json", "\"offset\" is " + value.dump()});
  refused(file_with("voxel_size", 0), {"bad.json", "\"voxel_size\" is 0"});
  for (const json& value : {json(0), json(1.5), json("1")})
    refused(file_with("risk", {{"min_confidence", value}}),
            {"bad.json", "\"min_confidence\" is " + value.dump()});
  json document = good();
  document.erase("offset");
  refused(folder_.write("bad.json", document.dump()), {"bad.json", "\"offset\" is missing"});
  const std::string text = good().dump();
  refused(folder_.write("bad.json", text.substr(0, text.size() / 2)), {"bad.json"});
  refused(folder_.write("bad.json", ""), {"bad.json"});
  refused(folder_.write("bad.json", "[1]"), {"bad.json", "no calibration"});
  refused(folder_.write("bad.json", R"({"gpureg": "calibration", "slope": NaN})"),
          {"bad.json", "slope"});
  refused(folder_.write("bad.json", R"({"gpureg": "calibration", "slope": 1e999})"), {"bad.json"});
  refused(folder_ / "none.json", {"none.json"});
  const std::string file = folder_.write("calibration.json", text);
  expect_refused(joined(registered(file), {"--preset", "loopsmart"}), {"--calibration"});
  expect_refused(joined(registered(file), {"--json", file}), {"--calibration", "--json"});
}

}  // namespace
}  // namespace gpureg::test
