// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "algorithm/cell.hpp"

namespace gpureg {

/// The space around a cloud's surfaces, in cells: on a surface, in front of one (where its normals
/// point: the side it was seen from), or behind one. Whoever saw a surface saw it through the space
/// in front of it; another cloud's points that hang there speak against a pose even where nobody
/// knows from where the clouds were seen. a cell has any of them
enum Place : std::uint32_t { kOnSurface = 1, kNearFront = 2, kFarFront = 4, kAtBack = 8 };

constexpr std::int32_t kFrontSteps = 10;     ///< cells that a front reaches
constexpr std::int32_t kNearFrontSteps = 5;  ///< of them, those that are near
constexpr std::uint32_t kCellsPerFrontWord = 8;
/// A cloud that is too wide for so many cells (32 MB) has no fronts.
constexpr std::uint64_t kMostFrontCells = std::uint64_t(1) << 26;

/// The cells: rows along x of whole words, eight cells a word, four bits a cell.
struct FrontBox {
  float cell_size = 1, inverse_cell_size = 1;
  Cell first{0, 0, 0};
  std::uint32_t words_x = 0, ny = 0, nz = 0;  ///< 0: no cells
  GPUREG_HD std::size_t words() const { return static_cast<std::size_t>(words_x) * ny * nz; }
};

struct FrontView {
  FrontBox box;
  const std::uint32_t* words = nullptr;  ///< null: no fronts
};

/// On the host only. lo, hi: corners of the cloud's box; reach: of the fronts, 0: none are asked
/// for.
inline FrontBox front_box(Vec3 lo, Vec3 hi, float reach, bool any_point) {
  FrontBox box;
  if (!any_point || !(reach > 0.0f)) return box;
  box.cell_size = reach / static_cast<float>(kFrontSteps);
  box.inverse_cell_size = 1.0f / box.cell_size;
  // In double: a box may be wider than cells can be counted.
  const float low[3] = {lo.x, lo.y, lo.z}, high[3] = {hi.x, hi.y, hi.z};
  double first[3], size[3], cells = 1;
  bool countable = true;
  for (int k = 0; k < 3; ++k) {
    const auto cell = [&](float v) {
      const double c = static_cast<double>(v) * static_cast<double>(box.inverse_cell_size);
      return static_cast<double>(static_cast<std::int64_t>(c < -1e9 ? -1e9 : c > 1e9 ? 1e9 : c));
    };
    // A step to spare on either side for what rounding does.
    first[k] = cell(low[k]) - (kFrontSteps + 2);
    size[k] = cell(high[k]) + (kFrontSteps + 2) - first[k] + 1;
    if (k == 0)
      size[k] = static_cast<double>(kCellsPerFrontWord) *
                static_cast<double>(static_cast<std::int64_t>(size[k] / kCellsPerFrontWord) + 1);
    cells *= size[k];
    countable = countable && first[k] > -8e8 && first[k] + size[k] < 8e8;
  }
  if (!countable || cells > static_cast<double>(kMostFrontCells)) return box;
  box.first = {static_cast<std::int32_t>(first[0]), static_cast<std::int32_t>(first[1]),
               static_cast<std::int32_t>(first[2])};
  box.words_x = static_cast<std::uint32_t>(size[0]) / kCellsPerFrontWord;
  box.ny = static_cast<std::uint32_t>(size[1]);
  box.nz = static_cast<std::uint32_t>(size[2]);
  return box;
}

/// Where a place's four bits are; word kNoValue: outside.
struct FrontCell {
  std::uint32_t word, shift;
};

GPUREG_HD FrontCell front_cell(const FrontBox& box, Vec3 q) {
  const float fx = q.x * box.inverse_cell_size, fy = q.y * box.inverse_cell_size,
              fz = q.z * box.inverse_cell_size;
  constexpr float limit = 1e9f;
  if (!(fx > -limit && fx < limit && fy > -limit && fy < limit && fz > -limit && fz < limit))
    return {kNoValue, 0};
  const std::uint32_t x = static_cast<std::uint32_t>(floor_to_int(fx) - box.first.x),
                      y = static_cast<std::uint32_t>(floor_to_int(fy) - box.first.y),
                      z = static_cast<std::uint32_t>(floor_to_int(fz) - box.first.z);
  if (x / kCellsPerFrontWord >= box.words_x || y >= box.ny || z >= box.nz) return {kNoValue, 0};
  return {(z * box.ny + y) * box.words_x + x / kCellsPerFrontWord, 4 * (x % kCellsPerFrontWord)};
}

/// The bits of a place: those of Place, or 0 where nothing is known.
GPUREG_HD std::uint32_t place_of(const FrontView& fronts, Vec3 q) {
  const FrontCell cell = front_cell(fronts.box, q);
  return cell.word == kNoValue ? 0u : (fronts.words[cell.word] >> cell.shift) & 15u;
}

/// Along a normal and against it, cell by cell, up to the next surface: mark(word, bits). Surfaces
/// must have been marked before. side 0: the front; 1: the back.
template <typename Mark>
GPUREG_HD void march_front(const FrontBox& box, const std::uint32_t* words, Vec3 point, Vec3 normal,
                           std::uint32_t side, Mark&& mark) {
  if (is_zero(normal)) return;
  const float sign = side == 0 ? box.cell_size : -box.cell_size;
  // The first step would mostly be in the surface's own cells.
  for (std::int32_t step = 2; step <= kFrontSteps; ++step) {
    const float h = sign * static_cast<float>(step);
    const FrontCell cell = front_cell(
        box, {fmaf(normal.x, h, point.x), fmaf(normal.y, h, point.y), fmaf(normal.z, h, point.z)});
    if (cell.word == kNoValue || (words[cell.word] >> cell.shift & kOnSurface) != 0) return;
    const std::uint32_t place = side == 1                 ? kAtBack
                                : step <= kNearFrontSteps ? kNearFront
                                                          : kFarFront;
    mark(cell.word, place << cell.shift);
  }
}

}  // namespace gpureg
