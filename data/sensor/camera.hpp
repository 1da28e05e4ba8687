// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

/// The pinhole that every frame is taken with.
namespace gpureg::synthetic::camera {

constexpr int kWidth = 640, kHeight = 480;
constexpr float kFocal = 525.0f, kCentreX = 319.5f, kCentreY = 239.5f;
constexpr double kFrameRate = 30.0;

/// The ray of a pixel, scaled so that its length parameter is the depth z.
inline Eigen::Vector3f ray(float x, float y) {
  return {(x - kCentreX) / kFocal, (y - kCentreY) / kFocal, 1.0f};
}

}  // namespace gpureg::synthetic::camera
