// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/hd.hpp"

namespace gpureg {

constexpr float kPi = 3.14159265358979f;

/// atan2 by an odd polynomial (least-squares minimax on [0, 1], error below 3e-7 rad in float). The
/// library functions of the two sides differ in the last bits, which would move a pair feature into
/// another FPFH bin. atan2(0, 0) is 0.
GPUREG_HD float exact_atan2(float y, float x) {
  const float ax = x < 0.0f ? -x : x;
  const float ay = y < 0.0f ? -y : y;
  const float larger = ax > ay ? ax : ay;
  const float smaller = ax > ay ? ay : ax;
  if (!(larger > 0.0f)) return 0.0f;
  const float t = smaller / larger;
  const float s = t * t;
  float p = -0.004054547753185034f;
  p = fmaf(p, s, 0.021862884983420372f);
  p = fmaf(p, s, -0.05591221898794174f);
  p = fmaf(p, s, 0.09642188996076584f);
  p = fmaf(p, s, -0.1390862613916397f);
  p = fmaf(p, s, 0.19946564733982086f);
  p = fmaf(p, s, -0.33329859375953674f);
  p = fmaf(p, s, 0.9999993443489075f);
  float angle = p * t;
  if (ay > ax) angle = 0.5f * kPi - angle;
  if (x < 0.0f) angle = kPi - angle;
  return y < 0.0f ? -angle : angle;
}

}  // namespace gpureg
