// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/jacobi.hpp"
#include "math/rigid.hpp"

namespace gpureg {

GPUREG_HD void add_covariance(Vec3 a, Vec3 b, float (&s)[3][3]) {
  s[0][0] = fmaf(a.x, b.x, s[0][0]);
  s[0][1] = fmaf(a.x, b.y, s[0][1]);
  s[0][2] = fmaf(a.x, b.z, s[0][2]);
  s[1][0] = fmaf(a.y, b.x, s[1][0]);
  s[1][1] = fmaf(a.y, b.y, s[1][1]);
  s[1][2] = fmaf(a.y, b.z, s[1][2]);
  s[2][0] = fmaf(a.z, b.x, s[2][0]);
  s[2][1] = fmaf(a.z, b.y, s[2][1]);
  s[2][2] = fmaf(a.z, b.z, s[2][2]);
}

/// Relative gap of the two largest eigenvalues below which a rotation is undetermined, well above
/// the rounding of float.
constexpr float kMinEigenvalueGap = 1e-4f;

/// Least-squares rigid motion from the cross-covariance s of centred pairs (Horn 1987: the largest
/// eigenvector of a 4 x 4 matrix, by Jacobi with fixed sweeps). cp, cq: the centroids. False where
/// the points do not determine a rotation (collinear or coincident).
GPUREG_HD bool solve_rigid(const float (&s)[3][3], Vec3 cp, Vec3 cq, Pose<float>& pose) {
  float n[4][4], v[4][4];
  n[0][0] = s[0][0] + s[1][1] + s[2][2];
  n[1][1] = s[0][0] - s[1][1] - s[2][2];
  n[2][2] = s[1][1] - s[0][0] - s[2][2];
  n[3][3] = s[2][2] - s[0][0] - s[1][1];
  n[0][1] = n[1][0] = s[1][2] - s[2][1];
  n[0][2] = n[2][0] = s[2][0] - s[0][2];
  n[0][3] = n[3][0] = s[0][1] - s[1][0];
  n[1][2] = n[2][1] = s[0][1] + s[1][0];
  n[1][3] = n[3][1] = s[2][0] + s[0][2];
  n[2][3] = n[3][2] = s[1][2] + s[2][1];
  jacobi_eigen<4, 6>(n, v);
  // Comparisons instead of an index: the GPU keeps arrays with a run-time index in memory.
  float largest = n[0][0], second = -3.402823466e38f;
  float w = v[0][0], x = v[1][0], y = v[2][0], z = v[3][0];
  for (int k = 1; k < 4; ++k) {
    const bool more = n[k][k] > largest;
    second = more ? largest : (n[k][k] > second ? n[k][k] : second);
    largest = more ? n[k][k] : largest;
    w = more ? v[0][k] : w;
    x = more ? v[1][k] : x;
    y = more ? v[2][k] : y;
    z = more ? v[3][k] : z;
  }
  // For collinear points the two largest eigenvalues are equal: the rotation about their line is
  // free.
  if (!(largest > 0.0f) || !(largest - second > kMinEigenvalueGap * largest)) return false;
  const float length = sqrtf(fmaf(w, w, fmaf(x, x, fmaf(y, y, z * z))));
  pose.w = w / length;
  pose.x = x / length;
  pose.y = y / length;
  pose.z = z / length;
  pose.tx = pose.ty = pose.tz = 0.0f;
  const Vec3 t = cq - rotate(to_rigid(pose), cp);
  pose.tx = t.x;
  pose.ty = t.y;
  pose.tz = t.z;
  return true;
}

/// Least-squares rigid motion of four point pairs.
GPUREG_HD bool fit_rigid(const Vec3 (&p)[4], const Vec3 (&q)[4], Pose<float>& pose) {
  const Vec3 cp = (p[0] + p[1] + p[2] + p[3]) * 0.25f;
  const Vec3 cq = (q[0] + q[1] + q[2] + q[3]) * 0.25f;
  float s[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  for (int k = 0; k < 4; ++k) add_covariance(p[k] - cp, q[k] - cq, s);
  return solve_rigid(s, cp, cq, pose);
}

/// Least-squares rigid motion of n point pairs, summed in their order.
GPUREG_HD bool fit_rigid(const Vec3* p, const Vec3* q, int n, Pose<float>& pose) {
  if (n < 3) return false;
  Vec3 cp{0, 0, 0}, cq{0, 0, 0};
  for (int k = 0; k < n; ++k) {
    cp = cp + p[k];
    cq = cq + q[k];
  }
  const float inverse = 1.0f / static_cast<float>(n);
  cp = cp * inverse;
  cq = cq * inverse;
  float s[3][3] = {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  for (int k = 0; k < n; ++k) add_covariance(p[k] - cp, q[k] - cq, s);
  return solve_rigid(s, cp, cq, pose);
}

}  // namespace gpureg
