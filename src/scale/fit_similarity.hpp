// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/fit.hpp"

namespace gpureg::scale {

/// p to rigid.r * p + rigid.t; rigid.r is a rotation times scale.
struct Similarity {
  Rigid rigid;
  float scale;
};

inline Vec3 centroid(const Vec3* p, int n) {
  Vec3 sum{0, 0, 0};
  for (int k = 0; k < n; ++k) sum = sum + p[k];
  return sum * (1.0f / static_cast<float>(n));
}

/// Similarity of n point pairs: the rotation of fit_rigid(), and the symmetric scale of Horn 1987,
/// the ratio of the spreads. That of least squares is too small where both sides have noise.
/// False where they do not determine one.
inline bool fit_similarity(const Vec3* p, const Vec3* q, int n, Similarity& out) {
  Pose<float> pose;
  if (!fit_rigid(p, q, n, pose)) return false;
  out.rigid = to_rigid(pose);
  const Vec3 cp = centroid(p, n), cq = centroid(q, n);
  float other = 0, own = 0;
  for (int k = 0; k < n; ++k) {
    other += squared_norm(q[k] - cq);
    own += squared_norm(p[k] - cp);
  }
  if (!(own > 0) || !(other > 0)) return false;
  out.scale = sqrtf(other / own);
  for (float& r : out.rigid.r) r *= out.scale;
  const Vec3 t = cq - rotate(out.rigid, cp);
  out.rigid.t[0] = t.x;
  out.rigid.t[1] = t.y;
  out.rigid.t[2] = t.z;
  return true;
}

}  // namespace gpureg::scale
