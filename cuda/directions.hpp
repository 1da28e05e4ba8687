// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>

#include "algorithm/cell.hpp"
#include "algorithm/cell_summary.hpp"

/// A coarse alphabet of directions, so that "may a point with this normal agree with a cell?" is one look-up in a small table. A normal
/// belongs to one of 62 classes. A cell's code is one byte: the nearest of 14 directions to its candidates' mean normal (high bits, 1..14;
/// 0: no candidate), and how far the candidates stray from it in steps of 10 degrees (low bits; 15: no bound). Per hypothesis and class
/// a row of 16 bytes says which low bits a code must have at least. Bounds only: no result depends on them.
namespace gpureg::cuda {

constexpr int kCellDirections = 14;
constexpr int kClasses = 62;
constexpr std::uint32_t kClassAny = 62;   ///< strays too far from every class: agrees with everything
constexpr std::uint32_t kClassNone = 63;  ///< no normal: agrees with nothing, unless normals are not tested
constexpr int kLevels = 15;
constexpr float kLevelDegrees = 10.0f;
constexpr float kClassRadiusDegrees = 17.0f;
constexpr float kSlackDegrees = 0.2f;     ///< for rounding
constexpr std::uint8_t kNever = 16;
constexpr int kThresholdBins = 128;

struct DirectionTables {
  Vec3 cell[kCellDirections];
  Vec3 classes[kClasses];
  float class_cosine;       ///< of kClassRadiusDegrees
};

/// Lowest level that is compatible, by the cosine between a class and a cell direction in bins over [-1, 1].
struct LevelThresholds {
  std::uint8_t lowest[kThresholdBins];
  std::uint8_t none;        ///< for points without a normal
};

/// Points evenly on a sphere along a golden spiral.
inline void spiral(Vec3* out, int count) {
  for (int k = 0; k < count; ++k) {
    const double z = 1.0 - (2.0 * k + 1.0) / count, r = std::sqrt(1.0 - z * z), turn = 2.399963229728653 * k;
    out[k] = {static_cast<float>(r * std::cos(turn)), static_cast<float>(r * std::sin(turn)), static_cast<float>(z)};
  }
}

inline DirectionTables direction_tables() {
  DirectionTables t;
  spiral(t.cell, kCellDirections);
  spiral(t.classes, kClasses);
  t.class_cosine = static_cast<float>(std::cos(static_cast<double>(kClassRadiusDegrees) * kDegrees));
  return t;
}

inline LevelThresholds level_thresholds(float max_normal_angle) {
  LevelThresholds t;
  t.none = max_normal_angle >= 180.0f ? 0 : kNever;
  for (int bin = 0; bin < kThresholdBins; ++bin) {
    // The smallest angle of the bin, as rounding may move a cosine into a neighbouring one.
    const double cosine = std::min(1.0, -1.0 + 2.0 * (bin + 1.01) / kThresholdBins);
    const double apart = std::acos(std::max(-1.0, cosine)) / kDegrees - static_cast<double>(max_normal_angle) - kClassRadiusDegrees - kSlackDegrees;
    // Level l stands for a spread of up to (l + 1) steps.
    const int lowest = max_normal_angle >= 180.0f ? 0 : static_cast<int>(std::ceil(apart / kLevelDegrees)) - 1;
    t.lowest[bin] = static_cast<std::uint8_t>(std::max(0, std::min(kLevels, lowest)));
  }
  return t;
}

GPUREG_HD std::uint32_t class_of_normal(const DirectionTables& t, Vec3 n) {
  if (is_zero(n)) return kClassNone;
  std::uint32_t best = 0;
  float cosine = -2.0f;
  for (int k = 0; k < kClasses; ++k) {
    const float c = dot(t.classes[k], n);
    if (c > cosine) cosine = c, best = static_cast<std::uint32_t>(k);
  }
  return cosine >= t.class_cosine ? best : kClassAny;
}

/// Code of a cell with at least one candidate. Candidates without a normal never agree, so they do not widen the bound; where normals are
/// not tested, every code but 0 passes.
GPUREG_HD std::uint8_t code_of_cell(const DirectionTables& t, Span<const std::uint32_t> candidates, const Vec3* normals) {
  Vec3 sum{0, 0, 0};
  for (const std::uint32_t i : candidates) sum = sum + normals[i];
  int best = 0;
  float nearest = dot(t.cell[0], sum);
  for (int k = 1; k < kCellDirections; ++k) {
    const float c = dot(t.cell[k], sum);
    if (c > nearest) nearest = c, best = k;
  }
  float cosine = 1.0f;
  for (const std::uint32_t i : candidates) {
    const float c = dot(t.cell[best], normals[i]);
    if (!is_zero(normals[i]) && c < cosine) cosine = c;
  }
  const double spread = acos(static_cast<double>(cosine < -1.0f ? -1.0f : cosine)) / kDegrees + static_cast<double>(kSlackDegrees);
  const int level = static_cast<int>(spread / static_cast<double>(kLevelDegrees));
  return static_cast<std::uint8_t>((best + 1) << 4 | (level < kLevels ? level : kLevels));
}

/// Row of one class under one rotation (any positive multiple of it is wrong: unit rows only).
GPUREG_HD void compatible_levels(const DirectionTables& t, const LevelThresholds& thresholds, const Rigid& rigid, std::uint32_t k, std::uint8_t (&row)[16]) {
  row[0] = kNever;
  row[15] = kNever;
  const Vec3 moved = k < static_cast<std::uint32_t>(kClasses) ? rotate(rigid, t.classes[k]) : Vec3{0, 0, 0};
  for (int d = 0; d < kCellDirections; ++d) {
    const int bin = static_cast<int>(dot(moved, t.cell[d]) * (0.5f * kThresholdBins) + 0.5f * kThresholdBins);
    const std::uint8_t lowest = thresholds.lowest[bin < 0 ? 0 : (bin >= kThresholdBins ? kThresholdBins - 1 : bin)];
    row[1 + d] = k == kClassAny ? std::uint8_t(0) : (k == kClassNone ? thresholds.none : lowest);
  }
}

}  // namespace gpureg::cuda
