// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/hd.hpp"

namespace gpureg {

struct Vec3 {
  float x, y, z;
};

GPUREG_HD Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
GPUREG_HD Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
GPUREG_HD Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
GPUREG_HD Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
GPUREG_HD float dot(Vec3 a, Vec3 b) { return fmaf(a.z, b.z, fmaf(a.y, b.y, a.x * b.x)); }
GPUREG_HD float squared_norm(Vec3 a) { return dot(a, a); }
GPUREG_HD float norm(Vec3 a) { return sqrtf(squared_norm(a)); }
GPUREG_HD Vec3 cross(Vec3 a, Vec3 b) {
  return {fmaf(a.y, b.z, -(a.z * b.y)), fmaf(a.z, b.x, -(a.x * b.z)), fmaf(a.x, b.y, -(a.y * b.x))};
}
GPUREG_HD bool is_zero(Vec3 a) { return a.x == 0.0f && a.y == 0.0f && a.z == 0.0f; }
GPUREG_HD bool all_finite(Vec3 a) {
  // x - x is 0 for finite x and NaN otherwise; no library call, so that nvcc and gcc agree.
  return a.x - a.x == 0.0f && a.y - a.y == 0.0f && a.z - a.z == 0.0f;
}
/// Unit vector, or zero where a is too short or not finite to have a direction.
GPUREG_HD Vec3 normalized_or_zero(Vec3 a) {
  const float length = norm(a);
  if (!(length > 1e-20f) || !all_finite(a)) return {0.0f, 0.0f, 0.0f};
  return {a.x / length, a.y / length, a.z / length};
}

}  // namespace gpureg
