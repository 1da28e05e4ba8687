// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <random>
#include <vector>

#include "math/vec3.hpp"

namespace gpureg::test {

/// Points on a bent, bumpy sheet with some clutter: surfaces with a well-defined normal nearly
/// everywhere. Width in metres.
inline std::vector<Vec3> bumpy_sheet(std::mt19937& random, std::size_t count, float width) {
  std::uniform_real_distribution<float> unit(0, 1), phase(0, 6.28f);
  const float a = phase(random), b = phase(random), c = phase(random);
  std::vector<Vec3> points(count);
  for (Vec3& p : points) {
    const float x = width * (unit(random) - 0.5f), y = width * (unit(random) - 0.5f);
    const float z = 0.3f * std::sin(2 * x + a) + 0.2f * std::cos(3 * y + b) +
                    0.1f * std::sin(5 * x * y + c) + 0.3f * x;
    p = {x, y, z + (unit(random) < 0.1f ? 0.4f * unit(random) : 0.0f)};
  }
  return points;
}

/// Points anywhere in a cube.
inline std::vector<Vec3> cube(std::mt19937& random, std::size_t count, float width) {
  std::uniform_real_distribution<float> place(-0.5f * width, 0.5f * width);
  std::vector<Vec3> points(count);
  for (Vec3& p : points) p = {place(random), place(random), place(random)};
  return points;
}

inline Vec3 random_unit(std::mt19937& random) {
  std::normal_distribution<float> normal;
  return normalized_or_zero({normal(random), normal(random), normal(random)});
}

}  // namespace gpureg::test
