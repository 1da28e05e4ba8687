// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "generated_sequence.hpp"

/// What goes wrong on the way: frames that are missing, black or of elsewhere, and Ctrl-C.
namespace slam_demo {
namespace {

namespace fs = std::filesystem;

SlamOptions without_map() {
  SlamOptions options = sequential();
  options.map = false;
  return options;
}

/// No pose of a session is far from the one before. The camera makes 2.5 cm a frame at most.
void expect_no_jump(const Slam& slam) {
  const std::vector<FramePose>& frames = slam.frames();
  for (std::size_t k = 1; k < frames.size(); ++k) {
    if (frames[k].session != frames[k - 1].session || frames[k].time - frames[k - 1].time > 0.05)
      continue;
    const double step = (world_from_camera(slam.map(), frames[k]).translation() -
                         world_from_camera(slam.map(), frames[k - 1]).translation())
                            .norm();
    EXPECT_LT(step, 0.08) << "at " << frames[k].time << " s";
  }
}

// The camera is covered for two seconds and goes on elsewhere. Whatever is found afterwards: no
// pose of a session jumps, and what is called one world fits the truth.
TEST(Faults, SixtyBlackFrames) {
  const Sequence sequence = open_sequence(frames_folder());
  const auto slam = run(sequence, without_map(), [](int k) { return k >= 50 && k < 110; });
  EXPECT_GE(slam->lost(), 60);
  EXPECT_LT(slam->lost(), 70) << "tracking starts again soon";
  expect_no_jump(*slam);
  const ErrorStatistics error = ate(slam->trajectory(), sequence.truth);
  EXPECT_GE(error.count, 40u);
  EXPECT_LT(error.rmse, 0.03);
}

// Both halves see the same places: the second session must come back into the first one's world.
TEST(Faults, ASessionThatComesBackIsMerged) {
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
  const auto slam = run(sequence, without_map(), [](int k) { return k >= 60 && k < 100; });
  EXPECT_EQ(slam->worlds(), 1u);
  const ErrorStatistics error = ate(slam->trajectory(), sequence.truth);
  EXPECT_GE(error.count, 98u);
  EXPECT_LT(error.rmse, 0.02);
}

// In one frame the camera is somewhere else: 50 frames are cut out.
TEST(Faults, Kidnapping) {
  Sequence sequence = open_sequence(frames_folder());
  const auto frames = sequence.frames;
  const auto truth = sequence.truth;
  sequence.frames.clear();
  sequence.truth.clear();
  for (std::size_t k = 0; k < 100; ++k) {
    const std::size_t from = k < 50 ? k : k + 50;
    sequence.frames.push_back(
        {static_cast<double>(k) / 30, frames[from].colour, frames[from].depth});
    sequence.truth.push_back({static_cast<double>(k) / 30, truth[from].world_from_body});
  }
  const auto slam = run(sequence, without_map(), [](int) { return false; });
  EXPECT_LT(slam->lost(), 10);
  expect_no_jump(*slam);
  const ErrorStatistics error = ate(slam->trajectory(), sequence.truth);
  EXPECT_GE(error.count, 40u);
  EXPECT_LT(error.rmse, 0.03) << "what is called one world fits the truth";
}

// A depth image that is missing, one that is cut off, and lines in a false order.
TEST(Faults, DamagedFramesAreLeftOut) {
  const gpureg::test::TemporaryFolder folder;
  const Sequence whole = open_sequence(frames_folder());
  fs::copy_file(whole.frames[20].depth, folder / "cut.png");
  fs::resize_file(folder / "cut.png", fs::file_size(folder / "cut.png") / 2);
  std::string list;
  for (std::size_t k = 0; k < 40; ++k) {
    const FrameFiles& frame = whole.frames[k == 30 ? 3 : k];
    const std::string depth = k == 10   ? folder / "missing.png"
                              : k == 20 ? folder / "cut.png"
                                        : frame.depth;
    list += std::to_string(frame.time) + " " + frame.colour + " " + std::to_string(frame.time) +
            " " + depth + "\n";
  }
  folder.write("associations.txt", list);
  const Sequence sequence = open_sequence(folder.path());
  EXPECT_EQ(sequence.frames.size(), 39u);
  EXPECT_EQ(sequence.out_of_order, 1u);
  EXPECT_EQ(load(sequence.frames[10], sequence.rig).problem,
            (folder / "missing.png") + ": missing, damaged, or not 16 bit");
  EXPECT_NE(load(sequence.frames[20], sequence.rig).problem, "");
  const auto slam = run(sequence, without_map(), [](int) { return false; });
  EXPECT_EQ(slam->lost(), 2);
  EXPECT_EQ(slam->worlds(), 1u) << "the next frame goes on where tracking was";
  expect_no_jump(*slam);
  EXPECT_LT(ate(slam->trajectory(), whole.truth).rmse, 0.015);
}

// The program, interrupted after its first report of progress.
TEST(Faults, AnInterruptedRunWritesWhatItHas) {
  const gpureg::test::TemporaryFolder output;
  int progress[2];
  ASSERT_EQ(pipe(progress), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    dup2(progress[1], STDERR_FILENO);
    close(progress[0]);
    execl(SLAM_DEMO, SLAM_DEMO, frames_folder().c_str(), "--output", output.path().c_str(),
          "--backend", "cpu", static_cast<char*>(nullptr));
    _exit(127);
  }
  close(progress[1]);
  std::string text;
  for (char c; text.find("frame 25 of 150") == std::string::npos && read(progress[0], &c, 1) == 1;)
    text += c;
  kill(child, SIGINT);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  close(progress[0]);
  EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 130) << text;
  const auto figures = nlohmann::json::parse(gpureg::test::content_of(output / "loops.json"));
  const std::size_t done = figures.at("frames_done");
  EXPECT_GE(done, 25u);
  EXPECT_LT(done, 150u);
  EXPECT_EQ(gpureg::evaluation::read_trajectory(output / "trajectory.txt").size(), done);
  for (const char* name : {"odometry.txt", "keyframes.txt", "map.ply", "report.html"})
    EXPECT_GT(fs::file_size(output / name), 0u) << name;
}

}  // namespace
}  // namespace slam_demo
