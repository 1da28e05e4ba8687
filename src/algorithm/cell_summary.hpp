// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/closest_build.hpp"
#include "math/trigonometry.hpp"

namespace gpureg {

// Summaries of the cells of a closest-point grid: bounds that decide most points without reading a
// target point. One word per cell: three signed bytes of the mean normal of the candidates, then a
// code. Bit 7 of the code: every location in the cell has a candidate within the search distance.
// Bits 0 to 6: largest angle between the mean and the normal of a candidate, in steps of 1.5
// degrees (127: no bound). No result depends on the last bit of a summary.

constexpr double kSummaryAngleStep = 1.5;
constexpr int kSummaryNoBound = 127;
/// Upper bounds of the rotation (degrees) and of the relative change of length of a unit vector
/// when its coordinates are rounded to steps of 1/127. They also cover normals packed in 30 bits.
constexpr double kSummaryQuantisation = 0.6;
constexpr double kSummaryStretch = 0.009;
constexpr double kDegrees = 3.14159265358979323846 / 180.0;

/// True where all of the cell lies within the search distance of p.
GPUREG_HD bool covers_cell(Vec3 p, Vec3 center, const ClosestGeometry& g) {
  const float h = 0.5f * g.cell_size + g.margin;
  const Vec3 d = p - center;
  const Vec3 far{(d.x < 0 ? -d.x : d.x) + h, (d.y < 0 ? -d.y : d.y) + h,
                 (d.z < 0 ? -d.z : d.z) + h};
  return norm(far) <= g.search_distance - g.margin;
}

GPUREG_HD std::uint32_t signed_byte(float unit) {
  return static_cast<std::uint32_t>(floor_to_int(unit * 127.0f + 0.5f)) & 0xffu;
}

/// Steps of the spread of a cell, from the least cosine, at most 1. The exact arc cosine is slow
/// and decides only near a whole step.
GPUREG_HD int summary_step(float cosine) {
  constexpr float kNearStep = 1e-2f;
  const float about = (acosf(cosine < -1.0f ? -1.0f : cosine) / static_cast<float>(kDegrees) +
                       static_cast<float>(kSummaryQuantisation)) /
                      static_cast<float>(kSummaryAngleStep);
  const float up = ceilf(about);
  int steps = static_cast<int>(up);
  if (!(up - about > kNearStep && up - about < 1.0f - kNearStep)) {
    const double angle =
        portable::acos(static_cast<double>(cosine < -1.0f ? -1.0f : cosine)) / kDegrees +
        kSummaryQuantisation;
    steps = static_cast<int>(ceil(angle / kSummaryAngleStep));
  }
  return steps < kSummaryNoBound ? steps : kSummaryNoBound;
}

/// Summary of a cell with at least one candidate.
GPUREG_HD std::uint32_t summarize_cell(Span<const std::uint32_t> candidates, Vec3 center,
                                       const ClosestGeometry& g, const Vec3* points,
                                       const Vec3* normals) {
  Vec3 sum{0, 0, 0};
  bool covered = false, bounded = true;
  for (const std::uint32_t i : candidates) {
    sum = sum + normals[i];
    bounded = bounded && !is_zero(normals[i]);
    covered = covered || covers_cell(points[i], center, g);
  }
  const Vec3 mean = normalized_or_zero(sum);
  int step = kSummaryNoBound;
  if (bounded && !is_zero(mean)) {
    float cosine = 1;
    for (const std::uint32_t i : candidates) {
      const float c = dot(mean, normals[i]);
      cosine = c < cosine ? c : cosine;
    }
    step = summary_step(cosine);
  }
  return signed_byte(mean.x) | signed_byte(mean.y) << 8 | signed_byte(mean.z) << 16 |
         static_cast<std::uint32_t>(step | (covered ? 128 : 0)) << 24;
}

/// Limits of the cosine between a moved normal and the mean normal of a cell, by code. Below the
/// first no candidate passes the normal test; above the second all pass, and one is within the
/// distance. Host only.
struct SummaryLimits {
  /// Margin for the rounding of a cosine in float.
  static constexpr float kCosineRounding = 1e-5f;
  float none_below[256];
  float all_above[256];

  /// exact_distance: the correspondence distance is that of the grid.
  SummaryLimits(float max_normal_angle_degrees, bool exact_distance) {
    for (int code = 0; code < 256; ++code) {
      const int step = code & 127;
      const double spread = step * kSummaryAngleStep + kSummaryQuantisation,
                   angle = static_cast<double>(max_normal_angle_degrees);
      none_below[code] = -2.0f;
      all_above[code] = 2.0f;
      const bool covered = (code & 128) != 0 && exact_distance;
      if (angle >= 180.0) {
        // Without a normal test the distance alone decides.
        if (covered) all_above[code] = -2.0f;
      } else if (step != kSummaryNoBound) {
        // The length of the rounded mean differs from 1, which scales the cosine up or down.
        const double widest = portable::cos((angle + spread) * kDegrees),
                     narrowest = portable::cos((angle - spread) * kDegrees);
        if (angle + spread < 180.0)
          none_below[code] = static_cast<float>(widest * (widest > 0 ? 1 - kSummaryStretch
                                                                     : 1 + kSummaryStretch)) -
                             kCosineRounding;
        if (covered && angle - spread > 0.0)
          all_above[code] = static_cast<float>(narrowest * (narrowest > 0 ? 1 + kSummaryStretch
                                                                          : 1 - kSummaryStretch)) +
                            kCosineRounding;
      }
    }
    // Code 0 is a cell without candidates (a real one has a spread of at least one step): no
    // inlier, whatever the normals.
    none_below[0] = 3.0f;
    all_above[0] = 3.0f;
  }
};

}  // namespace gpureg
