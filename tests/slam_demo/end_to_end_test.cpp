// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <gpureg/io.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "data/generate.hpp"
#include "output.hpp"
#include "support/temporary_folder.hpp"

/// 150 generated frames, made once for all tests of this process.
namespace slam_demo {
namespace {

using gpureg::evaluation::ErrorStatistics;

const std::string& frames_folder() {
  static const gpureg::test::TemporaryFolder folder;
  static const std::string path = [] {
    gpureg::synthetic::GenerateOptions options;
    options.fragments = 3;
    options.seed = 5;
    options.rgbd = true;
    gpureg::synthetic::generate(folder.path(), options);
    return folder.path();
  }();
  return path;
}

SlamOptions sequential() {
  SlamOptions options;
  options.tracker.sequential = true;
  options.loops.threads = 1;
  return options;
}

std::string text_of(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Runs the frames; those that `hide` names are black and without depth.
std::unique_ptr<Slam> run(const Sequence& sequence, const SlamOptions& options,
                          const std::function<bool(int)>& hide) {
  auto slam = std::make_unique<Slam>(gpureg::Context::cpu(), sequence.rig, options);
  for (int k = 0; k < static_cast<int>(sequence.frames.size()); ++k) {
    const FrameFiles& files = sequence.frames[static_cast<std::size_t>(k)];
    Images images = load(files, sequence.rig);
    if (hide(k)) {
      images.colour.setTo(cv::Scalar(0, 0, 0));
      images.grey.setTo(0);
      images.depth.setTo(0);
    }
    slam->frame(k, files.time, images);
  }
  slam->finish();
  return slam;
}

ErrorStatistics ate(const Trajectory& estimate, const Trajectory& truth) {
  return gpureg::evaluation::evaluate_trajectory(estimate, truth).absolute_translation;
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

  const gpureg::test::TemporaryFolder output;
  write_results(output.path(), *slam, result);
  const Trajectory read = gpureg::evaluation::read_trajectory(output / "trajectory.txt");
  ASSERT_EQ(read.size(), 150u);
  EXPECT_NEAR(ate(read, sequence.truth).rmse, result.final.absolute_translation.rmse, 1e-9);
  EXPECT_EQ(gpureg::io::read_point_cloud(output / "map.ply").points.size(),
            result.surface.distance.count);
  const auto json = nlohmann::json::parse(text_of(output / "loops.json"));
  EXPECT_EQ(json.at("fragments"), 3);
  EXPECT_NEAR(json.at("ate").at("rmse_m").get<double>(), result.final.absolute_translation.rmse,
              1e-12);
  const std::string page = text_of(output / "report.html");
  EXPECT_NE(page.find("const data = {"), std::string::npos);
  EXPECT_EQ(page.find("http"), std::string::npos) << "nothing is loaded from elsewhere";
}

TEST(EndToEnd, SequentialRunsGiveTheSameBits) {
  Sequence sequence = open_sequence(frames_folder());
  sequence.frames.resize(60);
  std::string text[2];
  for (std::string& t : text) {
    const gpureg::test::TemporaryFolder output;
    gpureg::evaluation::write_trajectory(output / "t.txt",
              run(sequence, sequential(), [](int) { return false; })->trajectory());
    t = text_of(output / "t.txt");
  }
  EXPECT_EQ(text[0], text[1]);
}

// The camera is covered for two seconds and goes on elsewhere. Whatever is found afterwards: no
// pose of a session jumps, and what is called one world fits the truth.
TEST(EndToEnd, SixtyBlackFrames) {
  const Sequence sequence = open_sequence(frames_folder());
  const auto slam = run(sequence, sequential(), [](int k) { return k >= 50 && k < 110; });
  EXPECT_GE(slam->lost(), 60);
  EXPECT_LT(slam->lost(), 70) << "tracking starts again soon";
  const std::vector<FramePose>& frames = slam->frames();
  for (std::size_t k = 1; k < frames.size(); ++k) {
    if (frames[k].session != frames[k - 1].session || frames[k].time - frames[k - 1].time > 0.05)
      continue;
    const double step = (world_from_camera(slam->map(), frames[k]).translation() -
                         world_from_camera(slam->map(), frames[k - 1]).translation())
                            .norm();
    EXPECT_LT(step, 0.08) << "at " << frames[k].time
                          << " s; the camera makes 2.5 cm a frame at most";
  }
  const ErrorStatistics error = ate(slam->trajectory(), sequence.truth);
  EXPECT_GE(error.count, 40u);
  EXPECT_LT(error.rmse, 0.03);
}

// Both halves see the same places: the second session must come back into the first one's world.
TEST(EndToEnd, ASessionThatComesBackIsMerged) {
  Sequence sequence = open_sequence(frames_folder());
  const auto frames = sequence.frames;
  const auto truth = sequence.truth;
  sequence.frames.assign(frames.begin(), frames.begin() + 60);
  sequence.truth.assign(truth.begin(), truth.begin() + 60);
  const auto append = [&](std::size_t from) {
    FrameFiles frame = frames[from];
    frame.time = sequence.frames.back().time + 1 / 30.0;
    gpureg::evaluation::StampedPose pose = truth[from];
    pose.time = frame.time;
    sequence.frames.push_back(frame);
    sequence.truth.push_back(pose);
  };
  for (std::size_t k = 0; k < 40; ++k) append(140);  // hidden below
  for (std::size_t k = 0; k < 40; ++k) append(39 - k);
  const auto slam = run(sequence, sequential(), [](int k) { return k >= 60 && k < 100; });
  EXPECT_EQ(slam->worlds(), 1u);
  const ErrorStatistics error = ate(slam->trajectory(), sequence.truth);
  EXPECT_GE(error.count, 98u);
  EXPECT_LT(error.rmse, 0.02);
}

}  // namespace
}  // namespace slam_demo
