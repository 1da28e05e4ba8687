// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/cholesky.hpp"
#include "math/rigid.hpp"

namespace gpureg {

/// Normal equations of point-to-plane ICP: 21 entries of J'WJ (lower triangle, row by row) and 6 of
/// J'Wr, in 2^-40 fixed point. Integer sums have the same bits in any order, so threads and blocks
/// add concurrently.
struct IcpSums {
  std::int64_t v[27];
};

/// 2^40: terms are at most 1, so the sums of 2^22 points fit 64 bits.
constexpr float kIcpFixedScale = 1099511627776.0f;

GPUREG_HD std::int64_t to_icp_fixed(float term) {
  return static_cast<std::int64_t>(term * kIcpFixedScale);
}

/// Adds one correspondence. arm: rotated source point (about the source's local origin) over its
/// radius, |arm| <= 1; normal: of the target; residual: point-to-plane distance over the max
/// distance; weight in [0, 1].
GPUREG_HD void add_icp_term(Vec3 arm, Vec3 normal, float residual, float weight, IcpSums& sums) {
  const Vec3 turn = cross(arm, normal);
  const float j[6] = {turn.x, turn.y, turn.z, normal.x, normal.y, normal.z};
  int k = 0;
  for (int a = 0; a < 6; ++a) {
    const float wa = weight * j[a];
    for (int b = 0; b <= a; ++b) sums.v[k++] += to_icp_fixed(wa * j[b]);
  }
  for (int a = 0; a < 6; ++a) sums.v[k++] += to_icp_fixed(weight * j[a] * residual);
}

/// Geman-McClure weight (k^2 / (k^2 + r^2))^2: 1 for r = 0, 1/4 at the kernel's width.
GPUREG_HD float robust_weight(float residual, float kernel_width) {
  const float k2 = kernel_width * kernel_width;
  const float f = k2 / fmaf(residual, residual, k2);
  return f * f;
}

/// Step length that ends the iteration, as a share of the max distance.
constexpr double kSettled = 1e-3;
/// Damping: a share of the trace, and an absolute part for empty sums.
constexpr double kRelativeDamping = 1e-6, kAbsoluteDamping = 1e-12;

struct IcpStep {
  double omega[3];
  double shift[3];
  bool valid;
};

/// Gauss-Newton step from the sums. radius: unit of the arms; max_distance: unit of the residual. A
/// small damping keeps the pose in directions without information (a lone plane, a corridor);
/// rounding would move it there.
GPUREG_HD IcpStep solve_icp(const IcpSums& sums, float radius, float max_distance) {
  const double unit = 1.0 / static_cast<double>(kIcpFixedScale);
  double a[6][6], b[6], x[6];
  int k = 0;
  double trace = 0.0;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) {
      a[i][j] = static_cast<double>(sums.v[k++]) * unit;
      if (i == j) trace += a[i][j];
    }
  for (int i = 0; i < 6; ++i) b[i] = -static_cast<double>(sums.v[k++]) * unit;
  const double damping = kRelativeDamping * trace + kAbsoluteDamping;
  for (int i = 0; i < 6; ++i) a[i][i] += damping;
  IcpStep step;
  step.valid = solve_cholesky6(a, b, x);
  for (int i = 0; i < 3; ++i) {
    step.omega[i] =
        step.valid ? x[i] * static_cast<double>(max_distance) / static_cast<double>(radius) : 0.0;
    step.shift[i] = step.valid ? x[i + 3] * static_cast<double>(max_distance) : 0.0;
  }
  return step;
}

/// True where the step moves no point by more than `share` of the max distance: the iteration has
/// settled.
GPUREG_HD bool icp_settled(const IcpStep& step, float radius, float max_distance, double share) {
  const double turn =
      step.omega[0] * step.omega[0] + step.omega[1] * step.omega[1] + step.omega[2] * step.omega[2];
  const double shift =
      step.shift[0] * step.shift[0] + step.shift[1] * step.shift[1] + step.shift[2] * step.shift[2];
  const double limit = share * static_cast<double>(max_distance);
  return turn * static_cast<double>(radius) * static_cast<double>(radius) + shift < limit * limit;
}

}  // namespace gpureg
