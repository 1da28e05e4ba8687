// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "algorithm/cell.hpp"
#include "algorithm/cell_summary.hpp"
#include "math/rigid.hpp"
#include "math/trigonometry.hpp"

/// A coarse quantisation of directions: one bit tells whether a point with some normal may agree
/// with a cell. A normal belongs to one of 62 classes. The code of a cell has four bits: 0 without
/// candidates; 1 to 14 for a direction within kReachDegrees of the normals of all its candidates;
/// 15 where there is no such direction. Per hypothesis and class a word holds the codes that may
/// agree. Bounds only: no result depends on them.
namespace gpureg::cuda {

constexpr int kCellDirections = 14;
constexpr std::uint32_t kClasses = 62;
/// Too far from every class: agrees with every code.
constexpr std::uint32_t kClassAny = 62;
/// No normal: agrees with no code, unless normals are not tested.
constexpr std::uint32_t kClassNone = 63;
constexpr std::uint32_t kCodeAny = 15;
constexpr float kReachDegrees = 40.0f;
constexpr float kClassRadiusDegrees = 17.0f;
constexpr float kSlackDegrees = 0.2f;  ///< for rounding

struct DirectionTables {
  Vec3 cell[kCellDirections];
  Vec3 classes[kClasses];
  float class_cosine;  ///< of kClassRadiusDegrees
  float reach_cosine;  ///< of kReachDegrees
};

/// Condition for a class to agree with a direction.
struct CodeTest {
  float min_cosine;  ///< between the two
  bool normals;      ///< false: normals are not tested
};

/// Points evenly on a sphere along a golden spiral.
inline void spiral(Vec3* out, int count) {
  for (int k = 0; k < count; ++k) {
    const double z = 1.0 - (2.0 * k + 1.0) / count, r = std::sqrt(1.0 - z * z),
                 turn = 2.399963229728653 * k;
    out[k] = {static_cast<float>(r * portable::cos(turn)),
              static_cast<float>(r * portable::sin(turn)), static_cast<float>(z)};
  }
}

inline DirectionTables direction_tables() {
  DirectionTables t;
  spiral(t.cell, kCellDirections);
  spiral(t.classes, static_cast<int>(kClasses));
  t.class_cosine =
      static_cast<float>(portable::cos(static_cast<double>(kClassRadiusDegrees) * kDegrees));
  t.reach_cosine = static_cast<float>(portable::cos(static_cast<double>(kReachDegrees) * kDegrees));
  return t;
}

inline CodeTest code_test(float max_normal_angle) {
  const double apart = static_cast<double>(max_normal_angle) +
                       static_cast<double>(kClassRadiusDegrees + kReachDegrees + kSlackDegrees);
  return {apart >= 180.0 ? -2.0f : static_cast<float>(portable::cos(apart * kDegrees)),
          max_normal_angle < 180.0f};
}

GPUREG_HD std::uint32_t class_of_normal(const DirectionTables& t, Vec3 n) {
  if (is_zero(n)) return kClassNone;
  std::uint32_t best = 0;
  float cosine = -2.0f;
  for (std::uint32_t k = 0; k < kClasses; ++k) {
    const float c = dot(t.classes[k], n);
    if (c > cosine) {
      cosine = c;
      best = k;
    }
  }
  return cosine >= t.class_cosine ? best : kClassAny;
}

/// Code of a cell with at least one candidate. Candidates without a normal never agree, so they do
/// not widen the bound; without a normal test every code but 0 passes.
GPUREG_HD std::uint32_t code_of_cell(const DirectionTables& t, Span<const std::uint32_t> candidates,
                                     const Vec3* normals) {
  Vec3 sum{0, 0, 0};
  for (const std::uint32_t i : candidates) sum = sum + normals[i];
  std::uint32_t best = 0;
  float nearest = dot(t.cell[0], sum);
  for (int k = 1; k < kCellDirections; ++k) {
    const float c = dot(t.cell[k], sum);
    if (c > nearest) {
      nearest = c;
      best = static_cast<std::uint32_t>(k);
    }
  }
  for (const std::uint32_t i : candidates)
    if (!is_zero(normals[i]) && dot(t.cell[best], normals[i]) < t.reach_cosine) return kCodeAny;
  return best + 1;
}

/// Codes that may agree with a class under one rotation: bit c for code c, repeated in the upper
/// half, because a funnel shift takes five bits.
GPUREG_HD std::uint32_t agreeing_codes(const DirectionTables& t, const CodeTest& test,
                                       const Rigid& rigid, std::uint32_t k) {
  std::uint32_t codes = 1u << kCodeAny;
  if (k < kClasses) {
    const Vec3 moved = rotate(rigid, t.classes[k]);
    for (int d = 0; d < kCellDirections; ++d)
      codes |= dot(moved, t.cell[d]) >= test.min_cosine ? 2u << d : 0u;
  }
  if (!test.normals || k == kClassAny) codes = 0xfffeu;
  if (test.normals && k == kClassNone) codes = 0u;
  return codes | codes << 16;
}

}  // namespace gpureg::cuda
