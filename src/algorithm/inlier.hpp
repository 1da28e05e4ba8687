// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/support.hpp"
#include "math/trigonometry.hpp"

namespace gpureg {

/// Test of an inlier: closest point within the distance, normals within the angle.
struct InlierTest {
  float max_squared;  ///< of the correspondence distance
  float inverse_max_squared;
  float min_cosine;  ///< between the normals; -1: no test
};

/// Host only: once per call.
inline InlierTest inlier_test(float max_distance, float max_normal_angle_degrees) {
  const float max_squared = max_distance * max_distance;
  const double angle =
      static_cast<double>(max_normal_angle_degrees) * 3.14159265358979323846 / 180.0;
  return {max_squared, 1.0f / max_squared,
          max_normal_angle_degrees >= 180.0f ? -1.0f : static_cast<float>(portable::cos(angle))};
}

}  // namespace gpureg
