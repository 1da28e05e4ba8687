// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <gpureg/io.hpp>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "generated_sequence.hpp"
#include "tracking/tracking_file.hpp"

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

/// The program in a process of its own. It cannot run away: the pipe of its progress has room for
/// one line and not for two, so that it waits until somebody reads.
class Interrupted {
 public:
  /// room: bytes, between the lengths of one and of two lines.
  Interrupted(std::vector<std::string> arguments, std::size_t room) {
    EXPECT_EQ(pipe(progress_), 0);
    const int size = fcntl(progress_[1], F_SETPIPE_SZ, 4096);
    EXPECT_EQ(size, 4096);
    const std::string filling(static_cast<std::size_t>(size) - room, '-');
    filled_ = static_cast<int>(filling.size());
    EXPECT_EQ(write(progress_[1], filling.data(), filling.size()), filled_);
    arguments.insert(arguments.begin(), SLAM_DEMO);
    std::vector<char*> words;
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    child_ = fork();
    if (child_ == 0) {
      dup2(progress_[1], STDERR_FILENO);
      close(progress_[0]);
      execv(SLAM_DEMO, words.data());
      _exit(127);
    }
    close(progress_[1]);
  }
  ~Interrupted() { close(progress_[0]); }
  Interrupted(const Interrupted&) = delete;
  Interrupted& operator=(const Interrupted&) = delete;

  /// Waits for the first line, interrupts the program, and reads what it still says. Returns its
  /// exit status.
  int after_the_first_line() {
    pollfd end{progress_[0], 0, 0};  // POLLHUP: the program has ended
    int bytes = 0;
    while (ioctl(progress_[0], FIONREAD, &bytes) == 0 && bytes == filled_ &&
           (poll(&end, 1, 10) == 0 || (end.revents & POLLHUP) == 0)) {
    }
    kill(child_, SIGINT);
    char part[512];
    for (ssize_t count; (count = read(progress_[0], part, sizeof(part))) > 0;)
      text.append(part, static_cast<std::size_t>(count));
    text.erase(0, static_cast<std::size_t>(filled_));
    int status = 0;
    EXPECT_EQ(waitpid(child_, &status, 0), child_);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  std::string text;  ///< what the program reported

 private:
  int progress_[2] = {-1, -1}, filled_ = 0;
  pid_t child_ = -1;
};

/// Every file of the output is there and can be read. Returns loops.json.
nlohmann::json read_output(const gpureg::test::TemporaryFolder& output, std::size_t poses) {
  for (const char* name : {"trajectory.txt", "odometry.txt"})
    EXPECT_EQ(gpureg::evaluation::read_trajectory(output / name).size(), poses) << name;
  EXPECT_GT(gpureg::io::read_point_cloud(output / "map.ply").points.size(), 10000u);
  const std::string page = gpureg::test::content_of(output / "report.html");
  EXPECT_NE(page.find("</script></html>"), std::string::npos);
  auto figures = nlohmann::json::parse(gpureg::test::content_of(output / "loops.json"));
  EXPECT_EQ(gpureg::evaluation::read_trajectory(output / "keyframes.txt").size(),
            figures.at("keyframes").get<std::size_t>());
  EXPECT_EQ(figures.at("frames_done"), poses);
  return figures;
}

TEST(Faults, AnInterruptedRunWritesWhatItHas) {
  const gpureg::test::TemporaryFolder output;
  Interrupted program({frames_folder(), "--output", output.path(), "--backend", "cpu"}, 100);
  EXPECT_EQ(program.after_the_first_line(), 130) << program.text;
  EXPECT_EQ(program.text.rfind("frame 25 of 150, ", 0), 0u) << program.text;
  // The second line, which it waits to write, comes after frame 50.
  const auto figures = nlohmann::json::parse(gpureg::test::content_of(output / "loops.json"));
  const std::size_t done = figures.at("frames_done");
  EXPECT_GE(done, 25u);
  EXPECT_LE(done, 50u);
  read_output(output, done);
}

TEST(Faults, AnInterruptedReplayWritesWhatItHas) {
  const gpureg::test::TemporaryFolder output;
  const Sequence sequence = open_sequence(frames_folder());
  SlamOptions options = sequential();
  options.loops.dense = options.loops.bundle = false;
  options.keep_fragments = true;
  Tracking tracking = run(sequence, options, [](int) { return false; })->tracking();
  ASSERT_EQ(tracking.fragments.size(), 3u);
  write_tracking(output / "tracking", tracking);
  Interrupted program({frames_folder(), "--output", output.path(), "--backend", "cpu", "--tracking",
                       output / "tracking"},
                      40);
  EXPECT_EQ(program.after_the_first_line(), 130) << program.text;
  EXPECT_EQ(program.text.rfind("fragment 1 of 3, ", 0), 0u) << program.text;
  EXPECT_EQ(program.text.find("fragment 3"), std::string::npos) << program.text;
  const auto figures = read_output(output, 150);
  EXPECT_GE(figures.at("fragments"), 1);
  EXPECT_LT(figures.at("fragments"), 3) << "the rest is left out";
}

// A guess of the focal length would bend the map, and nobody would see why.
TEST(Faults, UnknownCamerasAreAnError) {
  const gpureg::test::TemporaryFolder folder;
  const FrameFiles frame = open_sequence(frames_folder()).frames.front();
  folder.write("associations.txt", "1 " + frame.colour + " 1 " + frame.depth + "\n");
  const auto run = [&](const std::string& options) {
    const std::string command = std::string(SLAM_DEMO) + " " + folder.path() +
                                " --backend cpu --output " + (folder / "out") + options +
                                " > /dev/null 2> " + (folder / "errors");
    return std::system(command.c_str());
  };
  EXPECT_NE(run(""), 0);
  const std::string message = gpureg::test::content_of(folder / "errors");
  EXPECT_NE(message.find(folder.path() + ": its cameras are unknown"), std::string::npos)
      << message;
  EXPECT_NE(message.find("--camera"), std::string::npos);
  EXPECT_EQ(run(" --camera 525 525 319.5 239.5"), 0) << gpureg::test::content_of(folder / "errors");
  EXPECT_EQ(run(" --camera " + frames_folder() + "/camera.yaml"), 0);
  EXPECT_NE(run(" --camera 525 525"), 0);
  EXPECT_NE(run(" --camera " + (folder / "none.yaml")), 0);
  EXPECT_NE(gpureg::test::content_of(folder / "errors").find("none.yaml"), std::string::npos);
}

// The camera goes to and fro over one place. Fragments and surfels stay within their limits, and
// the map stays good.
TEST(Faults, APlaceThatIsSeenAgainAndAgainFillsNoMemory) {
  constexpr std::size_t kTurn = 75, kFrames = 300;
  const Sequence sequence = open_sequence(frames_folder());
  SlamOptions options = sequential();
  options.fragment_frames = 25;
  options.loops.max_fragments = 4;
  options.max_surfels = 130000;
  Slam slam(gpureg::Context::cpu(), sequence.rig, options);
  RunResult result;
  std::size_t before = 0;
  int thinned = 0;
  for (std::size_t k = 0; k < kFrames; ++k) {
    const std::size_t step = k % (2 * kTurn - 2), from = std::min(step, 2 * kTurn - 2 - step);
    const double time = static_cast<double>(k) / 30;
    slam.frame(static_cast<int>(k), time, load(sequence.frames[from], sequence.rig));
    result.truth.push_back({time, sequence.truth[from].world_from_body});
    ASSERT_LE(slam.all_surfels(), options.max_surfels);
    ASSERT_LE(slam.loops().fragments_kept(), 5u) << "the newest one is registered first";
    thinned += slam.all_surfels() < 2 * before / 3;
    before = slam.all_surfels();
  }
  slam.finish();
  EXPECT_EQ(slam.lost(), 0);
  EXPECT_EQ(slam.fragments(), 12);
  EXPECT_EQ(slam.loops().fragments_kept(), 4u);
  EXPECT_GE(thinned, 2) << "without the limit there are more surfels";
  evaluate(slam, frames_folder() + "/surface.ply", result);
  EXPECT_LT(result.final.absolute_translation.rmse, 0.02);
  EXPECT_GT(result.surface.distance.count, 20000u);
  EXPECT_LT(result.surface.distance.mean, 0.012);
}

}  // namespace
}  // namespace slam_demo
