// SPDX-License-Identifier: BSD-3-Clause
#include "output/progress.hpp"

#include <gtest/gtest.h>
#include <gpureg/error.hpp>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "support/expect_error.hpp"
#include "support/limited_file_size.hpp"
#include "support/temporary_folder.hpp"

namespace slam_demo {
namespace {

using gpureg::test::expect_error;
using nlohmann::json;

constexpr Pinhole kPinhole{500, 510, 320, 240};

std::vector<json> lines_of(const gpureg::test::TemporaryFolder& folder) {
  std::istringstream text(gpureg::test::content_of(folder / "progress.jsonl"));
  std::vector<json> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(json::parse(line));
  return lines;
}

/// A keyframe a metre to the right of the one before, with so many points of its own.
void add_keyframe(Map& map, int points) {
  Keyframe keyframe;
  keyframe.frame = 10 * static_cast<int>(map.keyframes.size());
  keyframe.time = keyframe.frame / 30.0;
  keyframe.world_from_camera.translation().x() = static_cast<double>(map.keyframes.size());
  for (int k = 0; k < points; ++k) {
    MapPoint point;
    point.first_keyframe = static_cast<int>(map.keyframes.size());
    point.position = keyframe.world_from_camera * Eigen::Vector3d(0, 0, 2);
    keyframe.points.push_back(static_cast<int>(map.points.size()));
    map.points.push_back(point);
  }
  keyframe.points.push_back(kNone);
  keyframe.points.push_back(0);  // of the first keyframe
  map.keyframes.push_back(keyframe);
}

LoopRecord loop_of(const std::string& state) {
  LoopRecord record;
  record.target_keyframe = 0;
  record.source_keyframe = 1;
  record.state = state;
  record.reason = "why";
  return record;
}

TEST(Progress, WritesEachChangeOnce) {
  const gpureg::test::TemporaryFolder folder;
  Progress progress(folder.path(), kPinhole);
  Map map;
  progress.update(0, map, {}, {});
  add_keyframe(map, 2);
  add_keyframe(map, 1);
  progress.update(12, map, {loop_of("candidate")}, {});
  progress.update(13, map, {loop_of("rejected")}, {});
  map.keyframes[1].world_from_camera.translation().z() = 0.0005;  // too little
  progress.update(14, map, {loop_of("accepted")}, {});
  map.keyframes[1].world_from_camera.translation().z() = 0.25;
  progress.update(15, map, {loop_of("accepted")}, {ImageLoopRecord{1, 0, 60, {}, false}});
  progress.update(16, map, {loop_of("retracted")}, {ImageLoopRecord{1, 0, 60, {}, true}});
  progress.update(17, map, {loop_of("retracted")}, {ImageLoopRecord{1, 0, 60, {}, true}});
  progress.end("finished");
  EXPECT_TRUE(progress.complete());

  const std::vector<json> expected = {
      {{"slam_demo_progress", 1}, {"camera", {500., 510., 320., 240.}}},
      {{"keyframe", 0},
       {"frame", 12},
       {"time", 0.},
       {"session", 0},
       {"pose", {0., 0., 0., 0., 0., 0., 1.}},
       {"points", {{0., 0., 2.}, {0., 0., 2.}, {0., 0., 2.}}}},
      {{"keyframe", 1},
       {"frame", 12},
       {"time", 10 / 30.},
       {"session", 0},
       {"pose", {1., 0., 0., 0., 0., 0., 1.}},
       {"points", {{0., 0., 2.}}}},
      {{"loop", 0}, {"frame", 14}, {"keyframes", {0, 1}}, {"state", "accepted"}, {"reason", "why"}},
      {{"moved", {{1, 1., 0., 0.25, 0., 0., 0., 1.}}}, {"frame", 15}},
      {{"loop", -1},
       {"frame", 15},
       {"keyframes", {0, 1}},
       {"state", "accepted"},
       {"reason", "image"}},
      {{"loop", 0},
       {"frame", 16},
       {"keyframes", {0, 1}},
       {"state", "retracted"},
       {"reason", "why"}},
      {{"loop", -1},
       {"frame", 16},
       {"keyframes", {0, 1}},
       {"state", "retracted"},
       {"reason", "image"}},
      {{"end", "finished"}, {"frame", 17}}};
  const std::vector<json> lines = lines_of(folder);
  ASSERT_EQ(lines.size(), expected.size());
  for (std::size_t k = 0; k < lines.size(); ++k) EXPECT_EQ(lines[k], expected[k]) << k;
}

TEST(Progress, FewPointsOfAKeyframe) {
  const gpureg::test::TemporaryFolder folder;
  Progress progress(folder.path(), kPinhole);
  Map map;
  add_keyframe(map, 999);
  map.points[0].bad = true;
  progress.update(1, map, {}, {});
  const std::size_t points = lines_of(folder).back().at("points").size();
  EXPECT_GT(points, 100u);
  EXPECT_LE(points, 200u);
}

TEST(Progress, ANewRunReplacesTheFileOfAnOldOne) {
  const gpureg::test::TemporaryFolder folder;
  folder.write("progress.jsonl", std::string(1000, '-'));
  const Progress progress(folder.path(), kPinhole);
  EXPECT_EQ(lines_of(folder).size(), 1u);
}

TEST(Progress, TwoRunsDoNotShareAFolder) {
  const gpureg::test::TemporaryFolder folder;
  {
    const Progress progress(folder.path(), kPinhole);
    expect_error<gpureg::IoError>([&] { Progress(folder.path(), kPinhole); },
                                  {folder / "progress.jsonl", "another run writes to this folder"});
    EXPECT_EQ(lines_of(folder).size(), 1u) << "the file of the first run stays";
  }
  EXPECT_NO_THROW(Progress(folder.path(), kPinhole));
}

TEST(Progress, NoFolder) {
  const gpureg::test::TemporaryFolder folder;
  const std::string file = folder.write("file", "");
  expect_error<gpureg::IoError>([&] { Progress(file + "/out", kPinhole); },
                                {"cannot make this folder"});
  std::filesystem::create_directories(folder / "out/progress.jsonl");
  expect_error<gpureg::IoError>([&] { Progress(folder / "out", kPinhole); }, {"cannot be written"});
}

TEST(Progress, AFullDiskEndsTheFileAndNotTheRun) {
  const gpureg::test::TemporaryFolder folder;
  Progress progress(folder.path(), kPinhole);
  {
    const gpureg::test::LimitedFileSize limit(100);
    Map map;
    add_keyframe(map, 1);
    progress.update(1, map, {}, {});
  }
  EXPECT_FALSE(progress.complete());
  const std::string before = gpureg::test::content_of(folder / "progress.jsonl");
  progress.end("finished");
  EXPECT_EQ(gpureg::test::content_of(folder / "progress.jsonl"), before);
}

}  // namespace
}  // namespace slam_demo
