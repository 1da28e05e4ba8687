// SPDX-License-Identifier: BSD-3-Clause
#include "generated_sequence.hpp"

#include <gtest/gtest.h>
#include <gpureg/error.hpp>
#include <gpureg/io.hpp>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "output/progress.hpp"
#include "output/rerun.hpp"
#include "tracking/tracking_file.hpp"

namespace slam_demo {
namespace {

double correlation(const DepthCalibration& a, const DepthCalibration& b) {
  constexpr auto kNodes = static_cast<Eigen::Index>(DepthCalibration::kNodes);
  const Eigen::Map<const Eigen::ArrayXd> x(a.offsets.data(), kNodes), y(b.offsets.data(), kNodes);
  const Eigen::ArrayXd dx = x - x.mean(), dy = y - y.mean();
  return (dx * dy).sum() / std::sqrt(dx.square().sum() * dy.square().sum());
}

TEST(EndToEnd, TrajectoryMapAndFiles) {
  const Sequence sequence = open_sequence(frames_folder());
  ASSERT_EQ(sequence.frames.size(), 150u);
  const auto slam = run(sequence, sequential(), [](int) { return false; });
  EXPECT_EQ(slam->lost(), 0);
  EXPECT_EQ(slam->fragments(), 3);
  EXPECT_EQ(slam->worlds(), 1u);
  RunResult result;
  result.sequence = frames_folder();
  result.truth = sequence.truth;
  evaluate(*slam, frames_folder() + "/surface.ply", result);
  ASSERT_EQ(result.final.matched, 150u);
  // 5 mm when this was written; five seconds of walking, 2.5 m.
  EXPECT_LT(result.final.absolute_translation.rmse, 0.015);
  EXPECT_LT(result.odometry.absolute_translation.rmse, 0.02);
  EXPECT_GT(result.surface.distance.count, 50000u);
  EXPECT_LT(result.surface.distance.mean, 0.012) << "3.7 mm when this was written";
  EXPECT_LT(result.surface.beyond, result.surface.distance.count / 1000);

  const DepthCalibration truth =
      read_depth_calibration(frames_folder() + "/true_depth_calibration.json");
  EXPECT_GT(truth.difference({}), 0.001) << "1/m: 1 cm at 3 m";
  EXPECT_GT(correlation(slam->map().calibration, truth), 0.5) << "0.85 when this was written";

  const gpureg::test::TemporaryFolder output;
  write_results(output.path(), *slam, result);
  const Trajectory read = gpureg::evaluation::read_trajectory(output / "trajectory.txt");
  ASSERT_EQ(read.size(), 150u);
  EXPECT_NEAR(ate(read, sequence.truth).rmse, result.final.absolute_translation.rmse, 1e-9);
  EXPECT_EQ(gpureg::io::read_point_cloud(output / "map.ply").points.size(),
            result.surface.distance.count);
  const auto json = nlohmann::json::parse(gpureg::test::content_of(output / "loops.json"));
  EXPECT_EQ(json.at("fragments"), 3);
  EXPECT_NEAR(json.at("ate").at("rmse_m").get<double>(), result.final.absolute_translation.rmse,
              1e-12);
  const std::string page = gpureg::test::content_of(output / "report.html");
  EXPECT_NE(page.find("const data = {"), std::string::npos);
  EXPECT_EQ(page.find("http"), std::string::npos) << "nothing is loaded from elsewhere";
}

// The depth image of the next frame, moved back by the motion of the last two frames, is nearer to
// that of this frame, whose noise remains.
TEST(EndToEnd, DepthImagesOfAnotherTime) {
  const Sequence sequence = open_sequence(frames_folder());
  const Pinhole& camera = sequence.rig.colour;
  Map map;
  const Extractor extractor;
  Tracker tracker(map, camera, sequential().tracker);
  EXPECT_EQ(tracker.motion_within(1).matrix(), Eigen::Isometry3d::Identity().matrix());
  double moved = 0, unmoved = 0;
  for (std::size_t k = 0; k + 1 < 60; ++k) {
    const FrameFiles& files = sequence.frames[k];
    const Images now = load(files, sequence.rig), next = load(sequence.frames[k + 1], sequence.rig);
    const Eigen::Isometry3d motion =
        tracker.motion_within(sequence.frames[k + 1].time - files.time);
    if (k > 2) {
      const auto difference = [&](const cv::Mat1f& depth) {
        const cv::Mat both = (now.depth > 0) & (depth > 0);
        return cv::mean(cv::abs(depth - now.depth), both)[0];
      };
      moved += difference(seen_from(camera, motion, camera, next.depth));
      unmoved += difference(next.depth);
    }
    tracker.track(static_cast<int>(k), files.time, extractor(now.grey, now.depth), now.grey,
                  now.depth);
  }
  EXPECT_LT(moved, 0.5 * unmoved) << moved << " " << unmoved;
}

// There and back: the loops of the way back are found while tracking goes on.
TEST(EndToEnd, LoopsBesideTracking) {
  Sequence sequence = open_sequence(frames_folder());
  const auto frames = sequence.frames;
  const auto truth = sequence.truth;
  for (std::size_t k = frames.size(); k-- > 0;) {
    sequence.frames.push_back(frames[k]);
    sequence.frames.back().time = static_cast<double>(sequence.frames.size() - 1) / 30;
    sequence.truth.push_back(truth[k]);
    sequence.truth.back().time = sequence.frames.back().time;
  }
  SlamOptions options;
  options.loops.parallel = true;
  const auto slam = run(sequence, options, [](int) { return false; });
  EXPECT_EQ(slam->lost(), 0);
  EXPECT_EQ(slam->worlds(), 1u);
  EXPECT_EQ(slam->fragments(), 6);
  EXPECT_EQ(slam->loops().fragments_kept(), 6u) << "all were registered at the end";
  EXPECT_FALSE(slam->loops().busy());
  EXPECT_EQ(slam->waits().size(), sequence.frames.size());
  EXPECT_LT(ate(slam->trajectory(), sequence.truth).rmse, 0.02);
}

// A depth camera that is wrong on one side: tracking corrects it long before the first loop.
TEST(EndToEnd, CalibratesTheDepthWithoutLoops) {
  const Sequence sequence = open_sequence(frames_folder());
  SlamOptions options = sequential();
  options.map = false;
  options.loops.dense = false;
  Slam slam(gpureg::Context::cpu(), sequence.rig, options);
  constexpr double kWrong = 0.02;  // 1/m, from the left edge to the right one
  for (int k = 0; k < 130; ++k) {
    Images images = load(sequence.frames[static_cast<std::size_t>(k)], sequence.rig);
    images.depth.forEach([](float& z, const int* at) {
      if (z > 0) z = static_cast<float>(1 / (1 / static_cast<double>(z) + kWrong * at[1] / 639));
    });
    slam.frame(k, sequence.frames[static_cast<std::size_t>(k)].time, images);
  }
  const DepthCalibration& found = slam.map().calibration;
  EXPECT_TRUE(slam.loops().graph().loops().empty());
  EXPECT_NEAR(found.offset(550, 240) - found.offset(90, 240), kWrong * 460 / 639, 0.3 * kWrong);
}

TEST(EndToEnd, SequentialRunsGiveTheSameBitsAndSoDoesTheFileOfTracking) {
  Sequence sequence = open_sequence(frames_folder());
  sequence.frames.resize(60);
  SlamOptions options = sequential();
  options.loops.bundle = false;
  options.keep_fragments = true;
  const auto once = run(sequence, options, [](int) { return false; }),
             again = run(sequence, options, [](int) { return false; });
  const gpureg::test::TemporaryFolder folder;
  Tracking tracking = once->tracking();
  ASSERT_EQ(tracking.fragments.size(), 1u);
  write_tracking(folder / "tracking", tracking);
  Slam replayed(gpureg::Context::cpu(), sequence.rig, options);
  replayed.replay(read_tracking(folder / "tracking"));
  EXPECT_EQ(replayed.fragments(), 1);
  EXPECT_EQ(replayed.all_surfels(), once->all_surfels());
  const Trajectory expected = once->trajectory();
  ASSERT_EQ(expected.size(), 60u);
  for (const Slam* other :
       {static_cast<const Slam*>(again.get()), static_cast<const Slam*>(&replayed)}) {
    const Trajectory found = other->trajectory();
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t k = 0; k < found.size(); ++k)
      EXPECT_EQ(found[k].world_from_body, expected[k].world_from_body) << k;
  }
  const std::string bytes = gpureg::test::content_of(folder / "tracking");
  folder.write("cut", bytes.substr(0, bytes.size() / 2));
  EXPECT_THROW(read_tracking(folder / "cut"), gpureg::IoError);
  folder.write("other", "slam_demo tracking 0\n");
  EXPECT_THROW(read_tracking(folder / "other"), gpureg::IoError);
}

/// The folder of an output with two keyframes and two surfels.
void write_small_output(const gpureg::test::TemporaryFolder& folder) {
  Map map;
  map.keyframes.resize(2);
  Progress progress(folder.path(), Pinhole());
  progress.update(9, map, {}, {});
  progress.end("finished");
  folder.write("odometry.txt", "0.0 0 0 0 0 0 0 1\n0.1 0.1 0 0 0 0 0 1\n");
  folder.write("map.ply", "ply\nend_header\n" + std::string(2 * 35, '\0'));
}

TEST(Rerun, WritesARecording) {
  if (std::system("python3 -c 'import rerun' 2> /dev/null") != 0)
    GTEST_SKIP() << "python3 has no rerun-sdk";
  const gpureg::test::TemporaryFolder folder;
  write_small_output(folder);
  write_rerun(folder.path(), folder / "map.rrd");
  const std::string bytes = gpureg::test::content_of(folder / "map.rrd");
  EXPECT_EQ(bytes.substr(0, 3), "RRF") << "the format's magic number";
  for (const char* entity :
       {"/world/map", "/world/trajectory", "/world/odometry", "/world/keyframes", "/world/camera"})
    EXPECT_NE(bytes.find(entity), std::string::npos) << entity;
  folder.write("map.ply", "no cloud");
  EXPECT_THROW(write_rerun(folder.path(), folder / "other.rrd"), gpureg::Error);
}

// Results lie in folders that others fill, too.
TEST(Rerun, TakesNoModuleOfTheCurrentFolder) {
  const gpureg::test::TemporaryFolder folder;
  for (const char* module : {"rerun", "numpy", "argparse"})
    folder.write(module + std::string(".py"), "open('taken', 'w')\n");
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  try {
    require_rerun();
  } catch (const gpureg::Error&) {
    // It may be missing.
  }
  std::filesystem::current_path(before);
  EXPECT_FALSE(std::filesystem::exists(folder / "taken"));
}

TEST(Rerun, SaysWhatIsMissing) {
  const gpureg::test::TemporaryFolder empty;
  const std::string path = std::getenv("PATH");
  setenv("PATH", empty.path().c_str(), 1);
  std::string message;
  try {
    require_rerun();
  } catch (const gpureg::Error& error) {
    message = error.what();
  }
  setenv("PATH", path.c_str(), 1);
  EXPECT_NE(message.find("python3"), std::string::npos) << message;
}

}  // namespace
}  // namespace slam_demo
