// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/vec3.hpp"

namespace gpureg {

/// Rigid transform for moving points: rotation row by row, then translation.
struct Rigid {
  float r[9];
  float t[3];
};

/// Rigid transform as stored per hypothesis and refined: unit quaternion (w, x, y, z) and
/// translation.
template <typename Scalar>
struct Pose {
  Scalar w, x, y, z;
  Scalar tx, ty, tz;
};

/// The pose that moves nothing.
template <typename Scalar>
GPUREG_HD Pose<Scalar> identity_pose() {
  Pose<Scalar> pose{};
  pose.w = Scalar(1);
  return pose;
}

template <typename Scalar>
GPUREG_HD void rotation_matrix(const Pose<Scalar>& p, Scalar* r) {
  const Scalar two = Scalar(2), one = Scalar(1);
  r[0] = one - two * (p.y * p.y + p.z * p.z);
  r[1] = two * (p.x * p.y - p.w * p.z);
  r[2] = two * (p.x * p.z + p.w * p.y);
  r[3] = two * (p.x * p.y + p.w * p.z);
  r[4] = one - two * (p.x * p.x + p.z * p.z);
  r[5] = two * (p.y * p.z - p.w * p.x);
  r[6] = two * (p.x * p.z - p.w * p.y);
  r[7] = two * (p.y * p.z + p.w * p.x);
  r[8] = one - two * (p.x * p.x + p.y * p.y);
}

template <typename Scalar>
GPUREG_HD Rigid to_rigid(const Pose<Scalar>& pose) {
  Scalar r[9];
  rotation_matrix(pose, r);
  Rigid out;
  for (int k = 0; k < 9; ++k) out.r[k] = static_cast<float>(r[k]);
  out.t[0] = static_cast<float>(pose.tx);
  out.t[1] = static_cast<float>(pose.ty);
  out.t[2] = static_cast<float>(pose.tz);
  return out;
}

GPUREG_HD Vec3 rotate(const Rigid& m, Vec3 p) {
  return {fmaf(m.r[2], p.z, fmaf(m.r[1], p.y, m.r[0] * p.x)),
          fmaf(m.r[5], p.z, fmaf(m.r[4], p.y, m.r[3] * p.x)),
          fmaf(m.r[8], p.z, fmaf(m.r[7], p.y, m.r[6] * p.x))};
}

GPUREG_HD Vec3 apply(const Rigid& m, Vec3 p) {
  return {fmaf(m.r[2], p.z, fmaf(m.r[1], p.y, fmaf(m.r[0], p.x, m.t[0]))),
          fmaf(m.r[5], p.z, fmaf(m.r[4], p.y, fmaf(m.r[3], p.x, m.t[1]))),
          fmaf(m.r[8], p.z, fmaf(m.r[7], p.y, fmaf(m.r[6], p.x, m.t[2])))};
}

GPUREG_HD Rigid inverse(const Rigid& m) {
  Rigid out{{m.r[0], m.r[3], m.r[6], m.r[1], m.r[4], m.r[7], m.r[2], m.r[5], m.r[8]}, {0, 0, 0}};
  const Vec3 t = rotate(out, {m.t[0], m.t[1], m.t[2]});
  out.t[0] = -t.x;
  out.t[1] = -t.y;
  out.t[2] = -t.z;
  return out;
}

/// Motion between the frames of two triangles: exact for congruent triangles, otherwise it keeps
/// the first corner and the direction of the first side. False where a triangle has no area.
GPUREG_HD bool carry_triangle(Vec3 p0, Vec3 p1, Vec3 p2, Vec3 q0, Vec3 q1, Vec3 q2, Rigid& out) {
  const Vec3 a = p1 - p0, b = cross(a, p2 - p0), c = cross(b, a);
  const Vec3 d = q1 - q0, e = cross(d, q2 - q0), f = cross(e, d);
  const float sa = squared_norm(a), sb = squared_norm(b), sd = squared_norm(d),
              se = squared_norm(e);
  if (!(sb > 0.0f) || !(se > 0.0f)) return false;
  const float first = 1.0f / sqrtf(sa * sd), second = 1.0f / sqrtf(sb * se), third = first * second;
  const float pa[3] = {a.x, a.y, a.z}, pb[3] = {b.x, b.y, b.z}, pc[3] = {c.x, c.y, c.z};
  const float qd[3] = {d.x * first, d.y * first, d.z * first},
              qe[3] = {e.x * second, e.y * second, e.z * second};
  const float qf[3] = {f.x * third, f.y * third, f.z * third};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      out.r[3 * i + j] = fmaf(qf[i], pc[j], fmaf(qe[i], pb[j], qd[i] * pa[j]));
  out.t[0] = out.t[1] = out.t[2] = 0.0f;
  const Vec3 t = q0 - rotate(out, p0);
  out.t[0] = t.x;
  out.t[1] = t.y;
  out.t[2] = t.z;
  return true;
}

GPUREG_HD Pose<double> widen(const Pose<float>& p) {
  Pose<double> q{p.w, p.x, p.y, p.z, p.tx, p.ty, p.tz};
  const double n = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  q.w /= n;
  q.x /= n;
  q.y /= n;
  q.z /= n;
  return q;
}

/// (rotation by the small vector omega, shift v) applied after p; exact rotation by the normalised
/// quaternion (1, omega / 2).
GPUREG_HD Pose<double> compose_small(const double* omega, const double* v, const Pose<double>& p) {
  const double x = 0.5 * omega[0], y = 0.5 * omega[1], z = 0.5 * omega[2];
  Pose<double> q;
  q.w = p.w - x * p.x - y * p.y - z * p.z;
  q.x = p.x + x * p.w + y * p.z - z * p.y;
  q.y = p.y + y * p.w + z * p.x - x * p.z;
  q.z = p.z + z * p.w + x * p.y - y * p.x;
  const double n = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  q.w /= n;
  q.x /= n;
  q.y /= n;
  q.z /= n;
  q.tx = p.tx + v[0];
  q.ty = p.ty + v[1];
  q.tz = p.tz + v[2];
  return q;
}

}  // namespace gpureg
