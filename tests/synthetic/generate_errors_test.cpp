// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <atomic>
#include <limits>

#include "gpureg/error.hpp"
#include "scene.hpp"
#include "support/expect_error.hpp"
#include "support/limited_file_size.hpp"

namespace gpureg::test {
namespace {

using synthetic::generate;
using synthetic::GenerateOptions;

void expect_invalid(void (*change)(GenerateOptions&), const std::string& field) {
  const TemporaryFolder folder;
  GenerateOptions options = small_scene();
  change(options);
  expect_error<InvalidArgument>([&] { generate(folder.path(), options); }, {field});
  EXPECT_EQ(folder.count(), 0u) << field;
}

TEST(GenerateErrors, OptionsOutOfRange) {
  expect_invalid([](GenerateOptions& o) { o.fragments = 0; }, "fragments is 0");
  expect_invalid([](GenerateOptions& o) { o.fragments = 10001; }, "fragments is 10001");
  expect_invalid([](GenerateOptions& o) { o.frames_per_fragment = 0; }, "frames_per_fragment is 0");
  expect_invalid([](GenerateOptions& o) { o.frames_per_fragment = 1001; },
                 "frames_per_fragment is 1001");
  expect_invalid([](GenerateOptions& o) { o.threads = -1; }, "threads is -1");
  expect_invalid(
      [](GenerateOptions& o) { o.sensor.min_depth = std::numeric_limits<double>::quiet_NaN(); },
      "sensor.min_depth");
  expect_invalid([](GenerateOptions& o) { o.sensor.max_depth = 0.3; }, "sensor.max_depth");
  expect_invalid([](GenerateOptions& o) { o.sensor.pixel_shift = -1; }, "sensor.pixel_shift");
  expect_invalid(
      [](GenerateOptions& o) {
        o.sensor.disparity_noise = std::numeric_limits<double>::infinity();
      },
      "sensor.disparity_noise");
  expect_invalid([](GenerateOptions& o) { o.sensor.distortion = 0.5; }, "sensor.distortion");
  expect_invalid([](GenerateOptions& o) { o.sensor.odometry_translation = -1; },
                 "sensor.odometry_translation");
  expect_invalid([](GenerateOptions& o) { o.sensor.odometry_rotation_degrees = 11; },
                 "sensor.odometry_rotation_degrees");
}

TEST(GenerateErrors, FolderThatCannotBe) {
  const TemporaryFolder folder;
  const std::string file = folder.write("file", "x");
  expect_error<IoError>([&] { generate(file, small_scene()); }, {file});
  expect_error<IoError>([&] { generate(file + "/below", small_scene()); }, {file});
  expect_error<IoError>([] { generate("", small_scene()); }, {"folder"});
  expect_error<IoError>([] { generate("/proc/gpureg", small_scene()); }, {"/proc/gpureg"});
}

TEST(GenerateErrors, FullDisk) {
  const TemporaryFolder folder;
  {
    const LimitedFileSize limit(20000);
    expect_error<IoError>([&] { generate(folder.path(), small_scene()); }, {"cloud_bin_"});
  }
  EXPECT_EQ(folder.count(), 0u) << "a partial file was left";
}

TEST(GenerateErrors, CloudsOfALargerScene) {
  const TemporaryFolder folder;
  folder.write("cloud_bin_3.ply", "of another run");
  expect_error<IoError>([&] { generate(folder.path(), small_scene()); }, {"cloud_bin_3.ply"});
  EXPECT_EQ(folder.count(), 1u);
}

TEST(GenerateErrors, StopsEarlyAndCleanly) {
  const TemporaryFolder folder;
  folder.write("gt.log", "of another run");
  std::atomic<int> asked{0};
  synthetic::Progress progress;
  progress.should_stop = [&] { return ++asked > 8; };
  synthetic::GenerateOptions options = small_scene();
  options.threads = 1;
  EXPECT_NO_THROW(generate(folder.path(), options, progress));
  const auto files = all_files(folder.path());
  EXPECT_EQ(files.size(), 1u) << "8 frames make one fragment of 6";
  EXPECT_EQ(files.count("cloud_bin_0.ply"), 1u);
}

TEST(GenerateErrors, ProgressIsTold) {
  const TemporaryFolder folder;
  std::map<std::string, std::vector<int>> told;
  synthetic::Progress progress;
  progress.report = [&](int done, int total, const char* stage) {
    EXPECT_EQ(total, 3);
    told[stage].push_back(done);
  };
  generate(folder.path(), small_scene(), progress);
  const std::vector<int> steps{0, 1, 2, 3};
  EXPECT_EQ(told["fragments"], steps);
  EXPECT_EQ(told["ground truth"], steps);
}

}  // namespace
}  // namespace gpureg::test
