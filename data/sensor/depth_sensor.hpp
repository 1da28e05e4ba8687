// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "data/generate.hpp"
#include "data/sensor/camera.hpp"
#include "data/sensor/ray_scene.hpp"

namespace gpureg::synthetic {

/// Every second pixel of every second row of a frame, starting at (phase_x, phase_y). A frame is
/// four of them; the noise of a pixel does not depend on which of them are made, so a fragment is
/// the same whether the full images were asked for or not.
struct DepthQuarter {
  static constexpr int kWidth = camera::kWidth / 2, kHeight = camera::kHeight / 2;
  int phase_x = 0, phase_y = 0;
  std::vector<float> depth;  ///< kWidth x kHeight, metres along the optical axis; 0: no measurement

  float pixel_x(int column) const { return static_cast<float>(2 * column + phase_x); }
  float pixel_y(int row) const { return static_cast<float>(2 * row + phase_y); }
};

/// A Kinect: a pattern projector beside an infrared camera. After Barron & Malik, "Intrinsic Scene
/// Properties from a Single RGB-D Image" (CVPR 2013), section 2 of the supplement, for noise and
/// quantisation, and Teichman et al. (RSS 2013) for the smooth distortion that grows with the
/// depth. One object serves any number of threads.
class DepthSensor {
 public:
  DepthSensor(const RayScene& scene, const SensorOptions& options, std::uint64_t seed);

  DepthQuarter capture(const Eigen::Isometry3d& world_from_camera, int frame, int phase_x,
                       int phase_y) const;

  /// Relative depth error of a surface at this pixel and depth, before noise.
  float distortion(float x, float y, float depth) const;

 private:
  struct Sample;
  bool lost(const std::vector<Sample>& samples, const DepthQuarter& image, int column, int row,
            std::uint64_t dice) const;
  void cast_shadow(const DepthQuarter& image, int row, std::vector<Sample>& samples) const;

  struct Wave {
    float x, y, phase;
  };
  const RayScene& scene_;
  SensorOptions options_;
  std::uint64_t seed_;
  std::array<Wave, 4> waves_;
};

}  // namespace gpureg::synthetic
