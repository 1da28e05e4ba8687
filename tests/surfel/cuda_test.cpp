// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <chrono>
#include <cstring>
#include <iostream>

#include "images.hpp"

namespace surfel::test {
namespace {

void expect_same(const SurfelMap& cpu, const SurfelMap& cuda, const char* when) {
  const Cloud a = cpu.download(), b = cuda.download();
  ASSERT_EQ(a.size(), b.size()) << when;
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(Surfel)), 0) << when;
}

/// Depth with the steps and holes of a real sensor.
std::vector<float> rough(std::vector<float> depth, int frame) {
  std::uint32_t state = 12345u + static_cast<std::uint32_t>(frame);
  for (float& z : depth) {
    state = state * 1664525u + 1013904223u;
    if (state >> 28 == 0) z = 0;
    z += 0.004f * (static_cast<float>(state >> 8 & 0xFFFFu) / 65536.0f - 0.5f) * z * z;
  }
  return depth;
}

TEST(SurfelsOnCuda, SameBytesAsOnTheCpu) {
  if (!cuda_available()) GTEST_SKIP() << "no CUDA device";
  Options options;
  options.active_frames = 20;
  options.trial_frames = 15;
  const auto cpu = make_cpu_map(options), cuda = make_cuda_map(options);
  std::vector<std::uint8_t> colour(3 * kWidth * kHeight);
  for (std::size_t k = 0; k < colour.size(); ++k) colour[k] = static_cast<std::uint8_t>(k * 7);
  std::vector<Correction> moves;
  for (int frame = 0; frame < 70; ++frame) {
    const float turn = 0.004f * static_cast<float>(frame);
    Pose pose =
        shifted(0.01f * static_cast<float>(frame % 30), 0, 0.002f * static_cast<float>(frame));
    const float rotation[9] = {std::cos(turn),  0, std::sin(turn), 0, 1, 0,
                               -std::sin(turn), 0, std::cos(turn)};
    for (int k = 0; k < 9; ++k) pose.r[k] = rotation[k];
    const std::vector<float> depth =
        rough(depth_of(frame % 40 < 20 ? wall(2.5) : ball(0, 0, 2, 0.8), shifted(0)), frame);
    const int since = frame < 50 ? 0 : 50;
    fuse(*cpu, depth, pose, frame, since, frame % 3 == 0 ? nullptr : colour.data());
    fuse(*cuda, depth, pose, frame, since, frame % 3 == 0 ? nullptr : colour.data());
    if (frame % 7 == 0)
      moves.push_back({frame, shifted(0.003f * static_cast<float>(frame)), frame < 50 ? 0 : 1});
  }
  expect_same(*cpu, *cuda, "after fusion");
  cpu->correct(moves);
  cuda->correct(moves);
  expect_same(*cpu, *cuda, "after correction");
}

// 2 million surfels, 200 keyframes, a frame of 640 x 480: what a large map needs.
TEST(SurfelsOnCuda, TimesOfALargeMap) {
  if (!cuda_available()) GTEST_SKIP() << "no CUDA device";
  constexpr std::size_t kSurfels = 2000000;
  Cloud surfels;
  for (std::size_t k = 0; k < kSurfels; ++k) {
    const float x = static_cast<float>(k % 2000) * 0.004f - 4,
                y = static_cast<float>(k / 2000) * 0.004f - 2;
    surfels.push_back({{x, y, 3},
                       {0, 0, -1},
                       0.004f,
                       5,
                       static_cast<int>(k % 4000),
                       static_cast<int>(k % 4000) + 60,
                       0x808080u});
  }
  std::vector<Correction> moves;
  for (int k = 0; k < 200; ++k) moves.push_back({20 * k, shifted(0.001f)});
  Options options;
  options.active_frames = 1000000;
  const auto map = make_cuda_map(options);
  map->upload(surfels);
  const int width = 640, height = 480;
  const std::vector<float> depth(static_cast<std::size_t>(width) * height, 3.0f);
  const Camera camera{525, 525, 319.5f, 239.5f};
  const auto milliseconds = [](const auto& work, int times) {
    const auto start = std::chrono::steady_clock::now();
    for (int k = 0; k < times; ++k) work(k);
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
               .count() /
           times;
  };
  map->correct(moves);  // warm
  const double correction = milliseconds([&](int) { map->correct(moves); }, 20);
  map->fuse({width, height, depth.data(), nullptr}, camera, Pose{}, 5000, 0);
  const double fusion = milliseconds(
      [&](int k) {
        map->fuse({width, height, depth.data(), nullptr}, camera, Pose{}, 5001 + k, 0);
      },
      15);
  std::cout << "correction of 2 million surfels by 200 keyframes: " << correction
            << " ms; fusion of a 640 x 480 frame: " << fusion << " ms, with copies" << std::endl;
  RecordProperty("correction_ms", std::to_string(correction));
  RecordProperty("fusion_ms", std::to_string(fusion));
  // Loose, so that a busy device does not fail: a correction that copies the map takes 30 ms.
  EXPECT_LT(correction, 20);
  EXPECT_LT(fusion, 20);
}

}  // namespace
}  // namespace surfel::test
