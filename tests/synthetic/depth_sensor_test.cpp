// SPDX-License-Identifier: BSD-3-Clause
#include "data/sensor/depth_sensor.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace gpureg::test {
namespace {

using Eigen::Vector3f;
using synthetic::DepthQuarter;
using synthetic::SensorOptions;

/// A large plane that the camera at the world's origin, looking along z, meets at this depth; tilt
/// turns it around the y axis.
synthetic::Mesh plane(float depth, float tilt = 0) {
  synthetic::Mesh mesh;
  synthetic::MeshBuilder builder(mesh);
  builder.place(Eigen::Translation3f(0, 0, depth) * Eigen::AngleAxisf(tilt, Vector3f::UnitY()));
  builder.paint({});
  builder.quad({-30, -30, 0}, {30, -30, 0}, {30, 30, 0}, {-30, 30, 0});
  return mesh;
}

struct Statistics {
  double mean = 0, deviation = 0;
  int count = 0;
};

/// Of depth minus truth over the valid pixels.
Statistics errors(const DepthQuarter& image, float truth) {
  Statistics s;
  double squares = 0;
  for (const float z : image.depth) {
    if (z <= 0) continue;
    ++s.count;
    s.mean += z - truth;
    squares += (z - truth) * (z - truth);
  }
  s.mean /= s.count;
  s.deviation = std::sqrt(squares / s.count - s.mean * s.mean);
  return s;
}

Statistics measure(float depth, const SensorOptions& options, float tilt = 0) {
  const synthetic::Mesh mesh = plane(depth, tilt);
  const synthetic::RayScene scene(mesh);
  return errors(
      synthetic::DepthSensor(scene, options, 5).capture(Eigen::Isometry3d::Identity(), 0, 0, 0),
      depth);
}

TEST(DepthSensor, NoiseGrowsWithTheSquareOfTheDepth) {
  // A frontal plane: noise of 1/6 step plus rounding to a step, so a deviation between 0.15 and 0.7
  // steps of z^2 / 351.3 m.
  for (const float depth : {0.8f, 1.5f, 2.2f, 3.1f, 3.8f}) {
    const Statistics s = measure(depth, {});
    const double step = depth * depth / 351.3;
    EXPECT_GT(s.deviation, 0.15 * step) << depth;
    EXPECT_LT(s.deviation, 0.7 * step + 0.007 * depth * depth / 3) << depth;
    EXPECT_LT(std::abs(s.mean), 0.5 * step + 0.007 * depth * depth / 3) << depth;
    EXPECT_GT(s.count, 0.95 * DepthQuarter::kWidth * DepthQuarter::kHeight) << depth;
  }
}

TEST(DepthSensor, DepthsAreWholeDisparitySteps) {
  const synthetic::Mesh mesh = plane(2.0f, 0.5f);
  const synthetic::RayScene scene(mesh);
  for (const float z :
       synthetic::DepthSensor(scene, {}, 5).capture(Eigen::Isometry3d::Identity(), 0, 0, 0).depth) {
    if (z <= 0) continue;
    ASSERT_NEAR(351.3f / z, std::round(351.3f / z), 1e-3f);
  }
}

TEST(DepthSensor, DistortionIsSmoothAndWithinItsAmplitude) {
  const synthetic::Mesh mesh = plane(2.0f);
  const synthetic::RayScene scene(mesh);
  const synthetic::DepthSensor sensor(scene, {}, 5);
  float largest = 0;
  for (float x = 0; x < 639; x += 3) {
    for (float y = 0; y < 480; y += 3) {
      const float here = sensor.distortion(x, y, 3);
      largest = std::max(largest, std::abs(here));
      ASSERT_LT(std::abs(sensor.distortion(x + 1, y, 3) - here), 0.007f * 0.03f);
      ASSERT_FLOAT_EQ(sensor.distortion(x, y, 1.5f), 0.5f * here);
    }
  }
  EXPECT_LE(largest, 0.007f);
  EXPECT_GT(largest, 0.002f);
}

TEST(DepthSensor, RangeIsKept) {
  SensorOptions exact;
  exact.distortion = 0;
  EXPECT_EQ(measure(0.3f, exact).count, 0);
  EXPECT_EQ(measure(4.3f, exact).count, 0);
  exact.max_depth = 6;
  EXPECT_GT(measure(4.3f, exact).count, 50000);
}

TEST(DepthSensor, GrazingSurfacesHaveHoles) {
  // At 80 degrees the pattern is stretched almost six times.
  const Statistics frontal = measure(2.0f, {}), steep = measure(2.0f, {}, 1.396f);
  EXPECT_LT(steep.count, 0.6 * frontal.count);
  EXPECT_GT(steep.count, 0);
}

TEST(DepthSensor, ABoxCastsAShadowToItsRight) {
  // A strip at 1 m before a wall at 3 m, seen from a camera whose projector is 7.5 cm to its left:
  // the strip's shadow on the wall is f b (1/1 - 1/3) = 26 pixels wide and lies at the strip's
  // right edge.
  synthetic::Mesh mesh = plane(3.0f);
  synthetic::MeshBuilder builder(mesh);
  builder.paint({});
  builder.box({-0.1f, -5, 1.0f}, {0.1f, 5, 1.01f});
  const synthetic::RayScene scene(mesh);
  const DepthQuarter image =
      synthetic::DepthSensor(scene, {}, 5).capture(Eigen::Isometry3d::Identity(), 0, 0, 0);
  const auto valid = [&](int from, int to) {
    int count = 0;
    for (int row = 0; row < DepthQuarter::kHeight; ++row) {
      for (int column = from; column < to; ++column)
        count += image.depth[static_cast<std::size_t>(row * DepthQuarter::kWidth + column)] > 0;
    }
    return static_cast<double>(count) / ((to - from) * DepthQuarter::kHeight);
  };
  // The strip spans columns (319.5 +- 52.5) / 2 = 133.5 .. 186.
  EXPECT_LT(valid(188, 197), 0.05) << "shadow";
  EXPECT_GT(valid(202, 230), 0.95) << "beyond the shadow";
  EXPECT_GT(valid(100, 131), 0.95) << "left of the strip";
  EXPECT_GT(valid(137, 182), 0.95) << "the strip itself";
}

}  // namespace
}  // namespace gpureg::test
