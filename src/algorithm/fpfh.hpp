// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/grid.hpp"
#include "math/atan2.hpp"

namespace gpureg {

/// Radius of the normals for the wide FPFH, wider in the same ratio as the features. At this
/// coarser scale noise averages out; normals of the narrow radius would give both features the same
/// errors. At most kMaxRadiusRatio feature radii: cells are half a feature radius wide, and a ball
/// of many thousands of cells takes hours. Host only.
inline float wide_normal_radius(float normal_radius, float feature_radius,
                                float wide_feature_radius) {
  const float wide = normal_radius * (wide_feature_radius / feature_radius),
              most = limits::kMaxRadiusRatio * feature_radius;
  return wide < most ? wide : most;
}

constexpr int kFpfhBins = 11;
constexpr int kFpfhSize = 3 * kFpfhBins;

GPUREG_HD int fpfh_bin(float unit) {
  const int b = floor_to_int(static_cast<float>(kFpfhBins) * unit);
  return b < 0 ? 0 : (b >= kFpfhBins ? kFpfhBins - 1 : b);
}

struct PairFeature {
  int bins[3];  ///< of theta, alpha and phi (Rusu et al. 2009, eq. 1; order as in PCL)
  bool valid;
};

/// Darboux-frame angles between two oriented points, binned. Differences to PCL: atan2 is a
/// polynomial and the switch compares the cosines instead of their arc cosines, so only pairs
/// within about 1e-6 of a bin's edge can fall into the neighbouring bin.
GPUREG_HD PairFeature pair_feature(Vec3 p1, Vec3 n1, Vec3 p2, Vec3 n2) {
  Vec3 d = p2 - p1;
  const float length = norm(d);
  if (!(length > 0.0f)) return {{0, 0, 0}, false};
  const float a1 = dot(n1, d) / length;
  const float a2 = dot(n2, d) / length;
  float phi = a1;
  if ((a1 < 0.0f ? -a1 : a1) < (a2 < 0.0f ? -a2 : a2)) {
    // The point with the normal closer to the connecting line is the source, which makes the
    // feature symmetric.
    const Vec3 swap = n1;
    n1 = n2;
    n2 = swap;
    d = -d;
    phi = -a2;
  }
  Vec3 v = cross(d, n1);
  const float v_norm = norm(v);
  if (!(v_norm > 0.0f)) return {{0, 0, 0}, false};
  v = {v.x / v_norm, v.y / v_norm, v.z / v_norm};
  const Vec3 w = cross(n1, v);
  const float alpha = dot(v, n2);
  const float theta = exact_atan2(dot(w, n2), dot(n1, n2));
  PairFeature f;
  f.bins[0] = fpfh_bin((theta + kPi) * (0.5f / kPi));
  f.bins[1] = fpfh_bin((alpha + 1.0f) * 0.5f);
  f.bins[2] = fpfh_bin((phi + 1.0f) * 0.5f);
  f.valid = true;
  return f;
}

/// Simplified histogram of one point: integer counts over its neighbours with a normal, independent
/// of their order. Returns the number of neighbours for normalisation (PCL: all neighbours but the
/// point itself).
GPUREG_HD int spfh_counts(const GridView& grid, Span<const Vec3> normals, std::uint32_t self,
                          Vec3 p, float radius, std::uint32_t* counts) {
  for (int b = 0; b < kFpfhSize; ++b) counts[b] = 0;
  const Vec3 n = normals[self];
  if (is_zero(n)) return 0;
  int neighbors = 0;
  for_each_neighbor(grid, p, radius, [&](std::uint32_t other, Vec3 q, float) {
    if (other == self) return;
    const Vec3 m = normals[other];
    if (is_zero(m)) return;
    ++neighbors;
    const PairFeature f = pair_feature(p, n, q, m);
    if (!f.valid) return;
    ++counts[f.bins[0]];
    ++counts[kFpfhBins + f.bins[1]];
    ++counts[2 * kFpfhBins + f.bins[2]];
  });
  return neighbors;
}

GPUREG_HD float spfh_value(std::uint32_t count, int neighbors) {
  return neighbors > 0 ? static_cast<float>(count) * (100.0f / static_cast<float>(neighbors))
                       : 0.0f;
}

/// Scales each of the three histograms to a sum of 100. False where one is empty: the point has no
/// feature.
GPUREG_HD bool normalize_fpfh(float* histogram) {
  for (int part = 0; part < 3; ++part) {
    float sum = 0.0f;
    for (int b = 0; b < kFpfhBins; ++b) sum = sum + histogram[part * kFpfhBins + b];
    if (!(sum > 0.0f)) return false;
    const float scale = 100.0f / sum;
    for (int b = 0; b < kFpfhBins; ++b)
      histogram[part * kFpfhBins + b] = histogram[part * kFpfhBins + b] * scale;
  }
  return true;
}

/// FPFH of one point: sum of the simplified histograms of the neighbours with weights 1 / squared
/// distance (as PCL), each part scaled to 100. spfh: rows of kFpfhSize. False, and a zero row,
/// where there is none.
GPUREG_HD bool weighted_fpfh(const GridView& grid, Span<const Vec3> normals, const float* spfh,
                             std::uint32_t self, Vec3 p, float radius, float* out) {
  for (int b = 0; b < kFpfhSize; ++b) out[b] = 0.0f;
  if (is_zero(normals[self])) return false;
  for_each_neighbor(grid, p, radius, [&](std::uint32_t other, Vec3, float d2) {
    if (!(d2 > 0.0f)) return;
    const float weight = 1.0f / d2;
    const float* row = spfh + static_cast<std::size_t>(other) * kFpfhSize;
    for (int b = 0; b < kFpfhSize; ++b) out[b] = fmaf(weight, row[b], out[b]);
  });
  if (normalize_fpfh(out)) return true;
  for (int b = 0; b < kFpfhSize; ++b) out[b] = 0.0f;
  return false;
}

}  // namespace gpureg
