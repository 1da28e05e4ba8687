// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/grid.hpp"
#include "math/jacobi.hpp"

namespace gpureg {

/// Variances, in units of the squared radius, below which neighbours count as one location, and
/// ratio of the two largest ones below which they count as one line: the rounding of float.
constexpr float kMinVariance = 1e-12f, kMinPlaneRatio = 1e-5f;

/// Normal of the plane through the neighbours of q by PCA, with arbitrary sign. Zero with fewer
/// than 3 neighbours (q included), or where they lie in one location or on one line.
GPUREG_HD Vec3 plane_normal(const GridView& grid, Vec3 q, float radius) {
  // Offsets from q in units of the radius: sums stay near 1, where float is accurate, whatever the
  // unit of the cloud.
  const float scale = 1.0f / radius;
  int n = 0;
  Vec3 s{0.0f, 0.0f, 0.0f};
  float xx = 0.0f, xy = 0.0f, xz = 0.0f, yy = 0.0f, yz = 0.0f, zz = 0.0f;
  for_each_neighbor(grid, q, radius, [&](std::uint32_t, Vec3 p, float) {
    const Vec3 d = (p - q) * scale;
    ++n;
    s = s + d;
    xx = fmaf(d.x, d.x, xx);
    xy = fmaf(d.x, d.y, xy);
    xz = fmaf(d.x, d.z, xz);
    yy = fmaf(d.y, d.y, yy);
    yz = fmaf(d.y, d.z, yz);
    zz = fmaf(d.z, d.z, zz);
  });
  if (n < 3) return {0.0f, 0.0f, 0.0f};
  const float inverse = 1.0f / static_cast<float>(n);
  const Vec3 m = s * inverse;
  float a[3][3], v[3][3];
  a[0][0] = fmaf(xx, inverse, -(m.x * m.x));
  a[1][1] = fmaf(yy, inverse, -(m.y * m.y));
  a[2][2] = fmaf(zz, inverse, -(m.z * m.z));
  a[0][1] = a[1][0] = fmaf(xy, inverse, -(m.x * m.y));
  a[0][2] = a[2][0] = fmaf(xz, inverse, -(m.x * m.z));
  a[1][2] = a[2][1] = fmaf(yz, inverse, -(m.y * m.z));
  jacobi_eigen<3, 5>(a, v);
  int lo = 0;
  if (a[1][1] < a[lo][lo]) lo = 1;
  if (a[2][2] < a[lo][lo]) lo = 2;
  const int i = (lo + 1) % 3, j = (lo + 2) % 3;
  const float hi = a[i][i] > a[j][j] ? a[i][i] : a[j][j];
  const float mid = a[i][i] > a[j][j] ? a[j][j] : a[i][i];
  // On a line the middle eigenvalue is pure rounding, and so would be the normal.
  if (!(hi > kMinVariance) || !(mid > kMinPlaneRatio * hi)) return {0.0f, 0.0f, 0.0f};
  return normalized_or_zero({v[0][lo], v[1][lo], v[2][lo]});
}

/// Sign of a normal: along the guide where there is one (the input's own normals), else towards the
/// nearest viewpoint.
GPUREG_HD Vec3 orient_normal(Vec3 normal, Vec3 point, Vec3 guide, Span<const Vec3> viewpoints) {
  Vec3 towards = guide;
  if (is_zero(guide)) {
    float best = 3.402823466e38f;
    for (std::size_t k = 0; k < viewpoints.size; ++k) {
      const Vec3 d = viewpoints[k] - point;
      const float d2 = squared_norm(d);
      if (d2 < best) {
        best = d2;
        towards = d;
      }
    }
  }
  return dot(normal, towards) < 0.0f ? -normal : normal;
}

/// True where the surface faces away from every viewpoint, by ten degrees at least: noise tilts the
/// normals of surfaces at grazing incidence, as of a distant floor.
GPUREG_HD bool faces_away(Vec3 normal, Vec3 point, Span<const Vec3> viewpoints) {
  constexpr float kSineSquared = 0.03f;  // of ten degrees
  for (std::size_t k = 0; k < viewpoints.size; ++k) {
    const Vec3 d = viewpoints[k] - point;
    const float along = dot(normal, d);
    if (!(along < 0.0f && along * along > kSineSquared * squared_norm(d))) return false;
  }
  return true;
}

/// True where the input normals that face away are flipped. Some input normals are wrong, mostly
/// along the edges of a fused surface (one in twenty of a real scan faces away from all cameras).
/// Where many face away, the viewpoints are wrong: they belong to another part of the scan.
/// PointCloudView::kMaxFacingAway as a divisor.
constexpr std::uint32_t kMaxFacingAwayPart = 8;
GPUREG_HD bool turns_back(std::uint32_t facing_away, std::uint32_t points) {
  return facing_away <= points / kMaxFacingAwayPart;
}

/// True where input normals may be flipped: normals and viewpoints are given, and the evidence uses
/// viewpoints (PrepareSettings::depth_maps). Host only.
inline bool turns_normals(bool has_normals, std::size_t viewpoints, std::uint32_t depth_maps) {
  return has_normals && viewpoints > 0 && depth_maps > 0;
}

}  // namespace gpureg
