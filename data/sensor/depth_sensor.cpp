// SPDX-License-Identifier: BSD-3-Clause
#include "data/sensor/depth_sensor.hpp"

#include <algorithm>
#include <cmath>

#include "data/random.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector3f;

constexpr float kDisparitySteps =
    351.3f;  // metres x steps: one step is z^2 / 351.3 m (Barron & Malik: 35130 with centimetres)
constexpr float kProjectorBaseline = 0.075f;  // metres, to the camera's left

float ramp(float low, float high, float x) {
  return std::clamp((x - low) / (high - low), 0.0f, 1.0f);
}

std::size_t index(int column, int row) {
  return static_cast<std::size_t>(row) * DepthQuarter::kWidth + static_cast<std::size_t>(column);
}

}  // namespace

struct DepthSensor::Sample {
  float z = 0;  // true depth; 0: nothing there
  bool shadowed = false;
  Vector3f normal;  // in the camera's frame
};

DepthSensor::DepthSensor(const RayScene& scene, const SensorOptions& options, std::uint64_t seed)
    : scene_(scene), options_(options), seed_(seed) {
  Random random(hash_key(seed, Purpose::distortion));
  for (Wave& wave : waves_) {  // half a wave to one and a half over the image
    wave = {random.uniform(0.5f, 1.5f) * 3.14159265f / camera::kWidth,
            random.uniform(0.5f, 1.5f) * 3.14159265f / camera::kHeight,
            random.uniform(0, 6.2831853f)};
    if (random.chance(0.5f)) wave.x = -wave.x;
  }
}

float DepthSensor::distortion(float x, float y, float depth) const {
  float field = 0;
  for (const Wave& wave : waves_) field += 0.4f * std::cos(wave.x * x + wave.y * y + wave.phase);
  return static_cast<float>(options_.distortion) * (depth / 3.0f) * std::clamp(field, -1.0f, 1.0f);
}

void DepthSensor::cast_shadow(const DepthQuarter& image, int row,
                              std::vector<Sample>& samples) const {
  // What the projector sees of this row: the nearest depth in each of its columns (2 pixels wide,
  // as the samples are).
  constexpr int kMargin = 64, kColumns = DepthQuarter::kWidth + 2 * kMargin;
  std::array<float, kColumns> nearest;
  nearest.fill(1e9f);
  const auto column_of = [&](int i, float z) {
    const float shift = camera::kFocal * kProjectorBaseline / z;
    return std::clamp(static_cast<int>(0.5f * (image.pixel_x(i) + shift) + 0.5f), 0, kColumns - 2);
  };
  for (int i = 0; i < DepthQuarter::kWidth; ++i) {
    const float z = samples[index(i, row)].z;
    if (z <= 0) continue;
    for (int c = 0; c < 2; ++c) {
      float& slot = nearest[static_cast<std::size_t>(column_of(i, z) + c)];
      slot = std::min(slot, z);
    }
  }
  for (int i = 0; i < DepthQuarter::kWidth; ++i) {
    Sample& s = samples[index(i, row)];
    if (s.z > 0)
      s.shadowed = s.z > 1.05f * nearest[static_cast<std::size_t>(column_of(i, s.z))] + 0.03f;
  }
}

bool DepthSensor::lost(const std::vector<Sample>& samples, const DepthQuarter& image, int column,
                       int row, std::uint64_t dice) const {
  const Sample& s = samples[index(column, row)];
  if (s.z < options_.min_depth || s.z > options_.max_depth || s.shadowed) return true;
  const Vector3f ray = camera::ray(image.pixel_x(column), image.pixel_y(row));
  // A pattern that is stretched along a grazing surface is not recognised; farther away it is also
  // dimmer.
  const float cosine = -s.normal.dot(ray) / ray.norm();
  const float seen = ramp(0.06f, 0.26f + 0.02f * s.z, cosine);
  if (unit_float(dice >> 40) > seen) return true;
  // Nor across a step: compare the neighbours with the plane of this sample.
  constexpr int kSteps[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
  for (const auto& step : kSteps) {
    const int c = column + step[0], r = row + step[1];
    if (c < 0 || r < 0 || c >= DepthQuarter::kWidth || r >= DepthQuarter::kHeight) continue;
    const float neighbour = samples[index(c, r)].z;
    const float slope = s.normal.dot(camera::ray(image.pixel_x(c), image.pixel_y(r)));
    if (slope > -1e-3f) continue;
    const float expected = s.z * s.normal.dot(ray) / slope, gap = 0.02f + 0.02f * s.z;
    const bool behind = neighbour > 0 && neighbour < expected - gap,
               before = neighbour <= 0 || neighbour > expected + gap;
    const float loss = behind ? 0.8f : before ? 0.4f : 0.0f;
    if (unit_float(dice >> 16) < loss) return true;
  }
  return false;
}

DepthQuarter DepthSensor::capture(const Eigen::Isometry3d& world_from_camera, int frame,
                                  int phase_x, int phase_y) const {
  DepthQuarter image;
  image.phase_x = phase_x;
  image.phase_y = phase_y;
  image.depth.assign(index(0, DepthQuarter::kHeight), 0.0f);
  const Eigen::Matrix3f rotation = world_from_camera.rotation().cast<float>();
  const Vector3f origin = world_from_camera.translation().cast<float>();
  const float shift = static_cast<float>(options_.pixel_shift),
              steps = static_cast<float>(options_.disparity_noise);

  const auto key = [&](Purpose purpose, int column, int row) {
    const int pixel = static_cast<int>(image.pixel_y(row)) * camera::kWidth +
                      static_cast<int>(image.pixel_x(column));
    return hash_key(seed_, purpose, static_cast<std::uint64_t>(frame),
                    static_cast<std::uint64_t>(pixel));
  };
  std::vector<Sample> samples(image.depth.size());
  for (int row = 0; row < DepthQuarter::kHeight; ++row) {
    for (int column = 0; column < DepthQuarter::kWidth; ++column) {
      const NormalPair n = normal_pair(key(Purpose::pixel, column, row));
      const Vector3f ray =
          camera::ray(image.pixel_x(column) + shift * n.a, image.pixel_y(row) + shift * n.b);
      const RayHit hit = scene_.cast(origin, rotation * ray);
      if (!hit.hit) continue;
      Sample& s = samples[index(column, row)];
      s.z = hit.t;
      s.normal = rotation.transpose() * hit.normal;
    }
    cast_shadow(image, row, samples);
  }
  for (int row = 0; row < DepthQuarter::kHeight; ++row) {
    for (int column = 0; column < DepthQuarter::kWidth; ++column) {
      const std::uint64_t dice = key(Purpose::hole, column, row);
      if (lost(samples, image, column, row, dice)) continue;
      const float z = samples[index(column, row)].z;
      const float distorted = z * (1 + distortion(image.pixel_x(column), image.pixel_y(row), z));
      const float disparity =
          std::floor(kDisparitySteps / distorted + steps * normal_pair(mix64(dice)).a + 0.5f);
      const float measured = kDisparitySteps / std::max(1.0f, disparity);
      if (measured < options_.min_depth || measured > options_.max_depth) continue;
      image.depth[index(column, row)] = measured;
    }
  }
  return image;
}

}  // namespace gpureg::synthetic
