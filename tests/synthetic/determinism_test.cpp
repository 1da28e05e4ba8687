// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "scene.hpp"

namespace gpureg::test {
namespace {

std::map<std::string, std::string> files_of(const synthetic::GenerateOptions& options) {
  const TemporaryFolder folder;
  synthetic::generate(folder.path(), options);
  return all_files(folder.path());
}

TEST(Determinism, SameBytesOnAnyNumberOfThreads) {
  synthetic::GenerateOptions options = small_scene();
  options.rgbd = true;
  options.frames_per_fragment = 2;
  options.threads = 1;
  const auto one = files_of(options);
  EXPECT_EQ(one.size(), 3u + 8u + 6u + 2u * 6u);
  for (const int threads : {2, 7}) {
    options.threads = threads;
    EXPECT_TRUE(files_of(options) == one) << threads << " threads";
  }
}

TEST(Determinism, SeedsDifferInEveryCloud) {
  const auto a = files_of(small_scene(1)), b = files_of(small_scene(2));
  for (const char* name :
       {"cloud_bin_0.ply", "cloud_bin_1.ply", "cloud_bin_2.ply", "poses.txt", "cameras.txt"}) {
    EXPECT_NE(a.at(name), b.at(name)) << name;
  }
}

TEST(Determinism, CloudsDoNotDependOnTheImages) {
  synthetic::GenerateOptions options = small_scene();
  options.frames_per_fragment = 2;
  const auto plain = files_of(options);
  options.rgbd = true;
  const auto with_images = files_of(options);
  for (const auto& [name, bytes] : plain) EXPECT_EQ(with_images.at(name), bytes) << name;
}

TEST(Determinism, LongScenesBeginWithShortOnes) {
  synthetic::GenerateOptions options = small_scene();
  options.frames_per_fragment = 3;
  const auto three = files_of(options);
  options.fragments = 5;
  const auto five = files_of(options);
  for (const char* name : {"cloud_bin_0.ply", "cloud_bin_1.ply", "cloud_bin_2.ply"})
    EXPECT_EQ(three.at(name), five.at(name)) << name;
}

}  // namespace
}  // namespace gpureg::test
