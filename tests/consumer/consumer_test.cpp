// SPDX-License-Identifier: BSD-3-Clause
// What somebody does who uses the installed package: install, find_package, build, run.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "command.hpp"
#include "gpureg/io.hpp"
#include "project/layout.hpp"
#include "support/scan.hpp"
#include "support/temporary_folder.hpp"

namespace gpureg {
namespace {

using test::Outcome;
using test::run_command;

const std::string kProjects = CONSUMER_SOURCE "/tests/consumer/";

// CMake breaks the lines of a message.
std::string one_line(const std::string& text) {
  std::istringstream words(text);
  std::string line;
  for (std::string word; words >> word;) line += (line.empty() ? "" : " ") + word;
  return line;
}

class Consumer : public testing::Test {
 protected:
  void SetUp() override {
    const Outcome installed = run_command({CONSUMER_CMAKE, "--install", CONSUMER_BUILD, "--config",
                                           CONSUMER_CONFIG, "--prefix", prefix_});
    ASSERT_EQ(installed.status, 0) << installed.output;
  }

  Outcome configure(const std::string& project, const std::string& flags) {
    std::vector<std::string> arguments = {CONSUMER_CMAKE,
                                          "-S",
                                          project,
                                          "-B",
                                          build_,
                                          "-G",
                                          CONSUMER_GENERATOR,
                                          "-DCMAKE_BUILD_TYPE=" CONSUMER_CONFIG,
                                          "-DCMAKE_CXX_COMPILER=" CONSUMER_COMPILER,
                                          "-DCMAKE_CXX_FLAGS=" CONSUMER_FLAGS " " + flags,
                                          "-DCMAKE_PREFIX_PATH=" + prefix_};
    const std::string toolkit = CONSUMER_CUDA_TOOLKIT;
    if (!toolkit.empty()) arguments.push_back("-DCUDAToolkit_ROOT=" + toolkit);
    return run_command(arguments);
  }

  void build(const std::string& project, const std::string& flags) {
    const Outcome configured = configure(project, flags);
    ASSERT_EQ(configured.status, 0) << configured.output;
    // The package that was just installed, and no other one of this machine.
    std::ifstream file(build_ + "/CMakeCache.txt");
    const std::string cache((std::istreambuf_iterator<char>(file)),
                            std::istreambuf_iterator<char>());
    ASSERT_NE(cache.find("gpureg_DIR:PATH=" + prefix_), std::string::npos) << cache;
    const Outcome built =
        run_command({CONSUMER_CMAKE, "--build", build_, "--config", CONSUMER_CONFIG});
    ASSERT_EQ(built.status, 0) << built.output;
  }

  // Two scans of one room, each in the frame of its sensor; returns target_from_source.
  Eigen::Isometry3d write_scans() {
    std::mt19937 random(7);
    const Eigen::Vector3d sensor = test::kRoomSensor.cast<double>();
    Eigen::Isometry3d target_from_room = Eigen::Isometry3d::Identity(),
                      source_from_room = test::random_pose(random, 0);
    target_from_room.translation() = -sensor;
    source_from_room.translation() =
        source_from_room.linear() * (-sensor - Eigen::Vector3d(0.2, -0.1, 0.05));
    PointCloud cloud;
    cloud.points = test::moved(source_from_room, test::scan_room(random));
    io::write_point_cloud(folder_ / "source.ply", cloud);
    cloud.points = test::moved(target_from_room, test::scan_room(random));
    io::write_point_cloud(folder_ / "target.ply", cloud);
    return target_from_room * source_from_room.inverse();
  }

  // A third scan of the same room, in the frame of the target.
  void write_third_scan() {
    std::mt19937 random(8);
    Eigen::Isometry3d target_from_room = Eigen::Isometry3d::Identity();
    target_from_room.translation() = -test::kRoomSensor.cast<double>();
    PointCloud cloud;
    cloud.points = test::moved(target_from_room, test::scan_room(random));
    io::write_point_cloud(folder_ / "third.ply", cloud);
  }

  // An example prints the pose last.
  void expect_example(const std::string& program, const Eigen::Isometry3d& truth) {
    SCOPED_TRACE(program);
    const Outcome outcome = run(program);
    const std::size_t title = outcome.output.rfind("target_from_source\n");
    ASSERT_NE(title, std::string::npos) << outcome.output;
    EXPECT_NE(outcome.output.find(explain(RegistrationReason::none)), std::string::npos);
    expect_pose(outcome, truth, outcome.output.substr(0, outcome.output.find('\n', title) + 1));
  }

  // A voxel is 5 cm and the noise 1 mm: what the refinement leaves is millimetres, a wrong pose is
  // off by decimetres.
  void expect_pose(const Outcome& outcome, const Eigen::Isometry3d& truth,
                   const std::string& before = "") {
    ASSERT_EQ(outcome.status, 0) << outcome.output;
    ASSERT_EQ(outcome.output.substr(0, before.size()), before);
    Eigen::Matrix4d pose;
    std::istringstream text(outcome.output.substr(before.size()));
    for (int k = 0; k < 16; ++k) ASSERT_TRUE(text >> pose(k / 4, k % 4)) << outcome.output;
    EXPECT_LT(test::translation_error(truth, Eigen::Isometry3d(pose)), 0.01) << outcome.output;
    EXPECT_LT(test::rotation_error_degrees(truth, Eigen::Isometry3d(pose)), 0.5) << outcome.output;
  }

  Outcome run(const std::string& program) {
    return run_command({build_ + "/" + program, folder_ / "source.ply", folder_ / "target.ply"});
  }

  void expect_working(const std::string& flags) {
    const Eigen::Isometry3d truth = write_scans();
    ASSERT_NO_FATAL_FAILURE(build(kProjects + "project", flags));
    expect_pose(run("register_two_clouds"), truth,
                std::string(explain(RegistrationReason::none)) + "\n");
    const Outcome printed = run_command({build_ + "/layout"});
    EXPECT_EQ(printed.status, 0) << printed.output;
    EXPECT_EQ(printed.output, layout() + kInformation);
  }

  test::TemporaryFolder folder_;
  const std::string prefix_ = folder_ / "prefix", build_ = folder_ / "build";
  // By hand from the moments in layout.cpp: [n I, -2 [s]x; 2 [s]x, 4 (tr(S) I - S)], s = (1, 2, 3),
  // S = diag(4, 5, 6), n = 3.
  static constexpr const char* kInformation =
      "information\n"
      " 3  0  0  0  6 -4\n"
      " 0  3  0 -6  0  2\n"
      " 0  0  3  4 -2  0\n"
      " 0 -6  4 44  0  0\n"
      " 6  0 -2  0 40  0\n"
      "-4  2  0  0  0 36\n"
      "error 0.25\n";
};

TEST_F(Consumer, DefaultFlags) { expect_working(""); }

// Eigen aligns by the processor that a file is compiled for: the public types must not depend on
// it.
TEST_F(Consumer, MarchNative) { expect_working("-march=native"); }

TEST_F(Consumer, Pcl) {
  if (!CONSUMER_HAVE_PCL) GTEST_SKIP() << "PCL is not installed";
  if (std::string(CONSUMER_FLAGS).find("-fsanitize=address") != std::string::npos)
    GTEST_SKIP() << "under AddressSanitizer Eigen allocates in another way than PCL's ready-made "
                    "libraries do";
  const Eigen::Isometry3d truth = write_scans();
  ASSERT_NO_FATAL_FAILURE(build(kProjects + "pcl_project", ""));
  expect_pose(run("register_with_pcl"), truth);
}

// examples/cpp, as its README says: built from the installed package.
TEST_F(Consumer, Examples) {
  const bool address = std::string(CONSUMER_FLAGS).find("-fsanitize=address") != std::string::npos;
  const Eigen::Isometry3d truth = write_scans();
  write_third_scan();
  ASSERT_NO_FATAL_FAILURE(build(CONSUMER_SOURCE "/examples/cpp", "-Wall -Wextra -Werror"));
  expect_example("01_two_clouds", truth);
  expect_example("04_own_features", truth);
  // Under AddressSanitizer Eigen allocates in another way than PCL's ready-made libraries do.
  if (CONSUMER_HAVE_PCL && !address) expect_example("03_pcl", truth);

  const Outcome batch = run_command({build_ + "/02_batch", folder_ / "target.ply",
                                     folder_ / "source.ply", folder_ / "third.ply"});
  EXPECT_EQ(batch.status, 0) << batch.output;
  EXPECT_NE(batch.output.find("1 into 0: aligned"), std::string::npos) << batch.output;
  EXPECT_NE(batch.output.find("3 of 3 pairs aligned\n"), std::string::npos) << batch.output;

  // Built where the CUDA toolkit is; without a device it says so.
  if (std::ifstream(build_ + "/05_cuda_stream")) {
    const Outcome stream = run("05_cuda_stream");
    if (stream.status == 0)
      expect_example("05_cuda_stream", truth);
    else
      EXPECT_EQ(stream.output.rfind("error: ", 0), 0u) << stream.output;
  }
  for (const char* name : {"01_two_clouds", "02_batch", "04_own_features"}) {
    const Outcome usage = run_command({build_ + "/" + name});
    EXPECT_EQ(usage.status, 2) << name;
    EXPECT_EQ(usage.output.rfind("usage: ", 0), 0u) << usage.output;
  }
}

// slam_demo is a project of its own: it finds the installed targets, and their headers are all that
// it includes. Building all of it takes minutes (gpureg's own build compiles it), so only
// its surfels are built here.
TEST_F(Consumer, SlamDemo) {
  if (!CONSUMER_HAVE_SLAM_DEMO) GTEST_SKIP() << "this build has no slam_demo";
  const std::string project = CONSUMER_SOURCE "/apps/slam_demo";
  const Outcome configured = configure(project, "-O0");
  ASSERT_EQ(configured.status, 0) << configured.output;
  std::size_t headers = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(project)) {
    std::ifstream file(entry.path());
    for (std::string line; std::getline(file, line);) {
      const std::string start = "#include <gpureg/";
      if (line.rfind(start, 0) != 0) continue;
      const std::string name = line.substr(start.size(), line.find('>') - start.size());
      EXPECT_TRUE(std::filesystem::exists(prefix_ + "/include/gpureg/" + name))
          << entry.path() << " includes " << name;
      ++headers;
    }
  }
  EXPECT_GT(headers, 10u);
  const Outcome built = run_command(
      {CONSUMER_CMAKE, "--build", build_, "--config", CONSUMER_CONFIG, "--target", "slam_surfel"});
  EXPECT_EQ(built.status, 0) << built.output;
}

// A component that this build does not have.
TEST_F(Consumer, MissingComponent) {
  std::ofstream(folder_ / "CMakeLists.txt")
      << "cmake_minimum_required(VERSION 3.20)\nproject(wish LANGUAGES CXX)\n"
         "find_package(gpureg CONFIG REQUIRED COMPONENTS io teleport)\n";
  const Outcome configured = configure(folder_.path(), "");
  EXPECT_NE(configured.status, 0);
  EXPECT_NE(one_line(configured.output)
                .find(R"(no component "teleport" (it has: files, evaluation, sets, pose_graph, )"
                      "reconstruction, loop_closure, localization, io"),
            std::string::npos)
      << configured.output;
}

// One that is asked for and may be missing is no error.
TEST_F(Consumer, OptionalComponent) {
  std::ofstream(folder_ / "CMakeLists.txt")
      << "cmake_minimum_required(VERSION 3.20)\nproject(wish LANGUAGES CXX)\n"
         "find_package(gpureg CONFIG REQUIRED COMPONENTS io OPTIONAL_COMPONENTS teleport)\n"
         "if(NOT TARGET gpureg::io OR NOT gpureg_io_FOUND OR gpureg_teleport_FOUND)\n"
         "  message(FATAL_ERROR \"wrong components\")\nendif()\n";
  const Outcome configured = configure(folder_.path(), "");
  EXPECT_EQ(configured.status, 0) << configured.output;
}

}  // namespace
}  // namespace gpureg
