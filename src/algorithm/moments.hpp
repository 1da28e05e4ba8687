// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/vec3.hpp"

namespace gpureg {

/// Count, sum and second moments (xx, xy, xz, yy, yz, zz) of points over a radius, in 2^-40 fixed
/// point: every order of summation gives the same bits.
struct Moments {
  std::uint64_t count;
  std::int64_t sum[3];
  std::int64_t outer[6];
};

/// 2^40: terms are at most 1, so the sums of 2^22 points fit 64 bits.
constexpr float kMomentFixedScale = 1099511627776.0f;

GPUREG_HD std::int64_t to_moment_fixed(float term) {
  return static_cast<std::int64_t>(term * kMomentFixedScale);
}

/// p: local point times 1 / radius, |p| <= 1.
GPUREG_HD void add_moment(Vec3 p, Moments& m) {
  ++m.count;
  m.sum[0] += to_moment_fixed(p.x);
  m.sum[1] += to_moment_fixed(p.y);
  m.sum[2] += to_moment_fixed(p.z);
  m.outer[0] += to_moment_fixed(p.x * p.x);
  m.outer[1] += to_moment_fixed(p.x * p.y);
  m.outer[2] += to_moment_fixed(p.x * p.z);
  m.outer[3] += to_moment_fixed(p.y * p.y);
  m.outer[4] += to_moment_fixed(p.y * p.z);
  m.outer[5] += to_moment_fixed(p.z * p.z);
}

}  // namespace gpureg
