// SPDX-License-Identifier: BSD-3-Clause
#include "data/tours/trajectory.hpp"

#include <algorithm>
#include <cmath>

#include "data/random.hpp"
#include "data/tours/tour.hpp"

namespace gpureg::synthetic {
namespace {

using Eigen::Vector2f;

constexpr float kSpeed = 0.0165f;  // metres per frame, on average
constexpr float kMaximumSpeed = 1.35f * kSpeed;
constexpr float kEyeLevel = 1.47f;  // metres, on average
constexpr int kGazeFrames = 45;     // how long a direction of view is kept
constexpr int kTurnFrames = 26;     // sigma of the smoothing of turns

float radians(float degrees) { return degrees * 0.0174532925f; }

/// Smooth noise over frames in about [-1, 1]: hashed values, cubic in between; a function of its
/// arguments alone.
float wander(std::uint64_t seed, std::uint64_t channel, float t) {
  const float cell = std::floor(t), f = t - cell, w = f * f * (3 - 2 * f);
  const auto value = [&](float at) {
    return 2 * unit_float(hash_key(seed, Purpose::shake, channel,
                                   static_cast<std::uint64_t>(static_cast<std::int64_t>(at))) >>
                          40) -
           1;
  };
  return (1 - w) * value(cell) + w * value(cell + 1);
}

/// The mean over neighbours with Gaussian weights; ends are repeated.
template <class T>
std::vector<T> smoothed(const std::vector<T>& values, float sigma) {
  const int reach = static_cast<int>(3 * sigma), n = static_cast<int>(values.size());
  std::vector<float> kernel;
  for (int k = -reach; k <= reach; ++k)
    kernel.push_back(std::exp(-0.5f * static_cast<float>(k * k) / (sigma * sigma)));
  std::vector<T> result(values.size());
  for (int i = 0; i < n; ++i) {
    T sum = values[0] * 0.0f;
    float weight = 0;
    for (int k = -reach; k <= reach; ++k) {
      const float w = kernel[static_cast<std::size_t>(k + reach)];
      sum += w * values[static_cast<std::size_t>(std::clamp(i + k, 0, n - 1))];
      weight += w;
    }
    result[static_cast<std::size_t>(i)] = sum * (1 / weight);
  }
  return result;
}

/// Of a few directions beside the way, the one where most of the view lies within the sensor's
/// comfortable range.
float choose_gaze(const RayScene& scene, const Vector2f& at, float heading, std::uint64_t seed,
                  int glance) {
  Random random(hash_key(seed, Purpose::gaze, static_cast<std::uint64_t>(glance)));
  float best = 0, score = -1e9f;
  for (int k = 0; k < 8; ++k) {
    const float offset = std::clamp(radians(48) * random.normal(), radians(-130), radians(130));
    float seen = 0;
    for (float side = -30; side <= 30; side += 7.5f) {
      for (float pitch = -36; pitch <= 8; pitch += 11) {
        const float yaw = heading + offset + radians(side), level = std::cos(radians(pitch));
        const RayHit hit =
            scene.cast({at.x(), at.y(), kEyeLevel},
                       {level * std::cos(yaw), level * std::sin(yaw), std::sin(radians(pitch))});
        if (hit.hit)
          seen +=
              std::clamp((hit.t - 0.5f) / 1.5f, 0.0f, 1.0f) * std::clamp(4.5f - hit.t, 0.0f, 1.0f);
      }
    }
    const float value = seen / 45 - 0.08f * std::abs(offset);
    if (value > score) {
      score = value;
      best = offset;
    }
  }
  return best;
}

}  // namespace

std::vector<Eigen::Isometry3d> walk(const House& house, const RayScene& scene, std::uint64_t seed,
                                    int frames, float no_return) {
  // Frames beyond the last one, so that smoothing treats a short walk like the beginning of a long
  // one.
  const int total = frames + 6 * kTurnFrames + 2 * kGazeFrames;
  const std::vector<Vector2f> line = smoothed(
      tour(house, scene, seed, kMaximumSpeed * static_cast<float>(total) + 4, no_return), 12);
  const auto sample = [&](float s) {
    const float u = std::clamp(s / kTourSpacing, 0.0f, static_cast<float>(line.size() - 2));
    const auto i = static_cast<std::size_t>(u);
    const float f = u - static_cast<float>(i);
    return Vector2f((1 - f) * line[i] + f * line[i + 1]);
  };
  std::vector<Vector2f> position;
  std::vector<float> heading, offset;
  float s = 0.5f, last = 0;
  for (int k = 0; k < total; ++k) {
    const Vector2f ahead = sample(s + 0.5f) - sample(s - 0.3f);
    float angle = ahead.norm() > 0.02f ? std::atan2(ahead.y(), ahead.x()) : last;
    while (angle - last > 3.14159265f) angle -= 6.2831853f;
    while (angle - last < -3.14159265f) angle += 6.2831853f;
    last = angle;
    position.push_back(sample(s));
    heading.push_back(angle);
    s += kSpeed * (1 + 0.3f * wander(seed, 0, static_cast<float>(k) / 45.0f));
  }
  heading = smoothed(heading, kTurnFrames);
  for (int k = 0; k < total; ++k) {  // a gaze suits the middle of its time
    const auto middle = static_cast<std::size_t>(std::min(k + kGazeFrames / 2, total - 1));
    offset.push_back(k % kGazeFrames == 0 ? choose_gaze(scene, position[middle], heading[middle],
                                                        seed, k / kGazeFrames)
                                          : offset.back());
  }
  offset = smoothed(offset, kTurnFrames);
  std::vector<Eigen::Isometry3d> poses;
  for (int k = 0; k < frames; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const float t = static_cast<float>(k);
    const auto tremble = [&](std::uint64_t channel, float period) {
      return wander(seed, channel, t / period);
    };
    const double yaw =
        heading[i] + offset[i] + radians(6) * tremble(1, 35) + radians(0.4f) * tremble(2, 5);
    const double pitch =
        radians(-15.5f) + radians(9) * tremble(3, 70) + radians(0.4f) * tremble(4, 5);
    const double roll = radians(4) * tremble(5, 60) + radians(0.4f) * tremble(6, 5);
    const double height = kEyeLevel + 0.17 * tremble(7, 130) + 0.012 * std::sin(0.42 * t);
    Eigen::Matrix3d
        level;  // columns: the camera's right, down and forward when it looks along world x
    level << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(-pitch, Eigen::Vector3d::UnitY()))
                        .toRotationMatrix() *
                    level * Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    pose.translation() = Eigen::Vector3d(position[i].x() + 0.004 * tremble(8, 6),
                                         position[i].y() + 0.004 * tremble(9, 6), height);
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace gpureg::synthetic
