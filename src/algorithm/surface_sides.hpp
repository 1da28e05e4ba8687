// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "algorithm/cell.hpp"

namespace gpureg {

/// Side of a surface that a cell lies on: on it, in front of it (where its normals point, the side
/// that was observed; near or far), or behind it. A cell may have several of these bits. The space
/// in front of an observed surface was empty, so points of another cloud there contradict a pose
/// even without known viewpoints.
enum SurfaceSide : std::uint32_t { kOnSurface = 1, kFrontNear = 2, kFrontFar = 4, kBehind = 8 };

constexpr std::int32_t kSurfaceSideSteps = 10;  ///< cells marked along a normal, to either side
constexpr std::int32_t kFrontNearSteps = 5;     ///< the first of them count as near
constexpr std::uint32_t kCellsPerSurfaceSideWord = 8;

/// The cells: rows along x of whole words, eight cells a word, four bits a cell.
struct SurfaceSideGrid {
  float cell_size = 1, inverse_cell_size = 1;
  Cell first{0, 0, 0};
  std::uint32_t words_x = 0, ny = 0, nz = 0;  ///< 0: no cells
  GPUREG_HD std::size_t words() const { return static_cast<std::size_t>(words_x) * ny * nz; }
};

struct SurfaceSideView {
  SurfaceSideGrid box;
  const std::uint32_t* words = nullptr;  ///< null: not known
};

/// Host only. lo, hi: corners of the cloud's box; distance: range to either side of a surface, 0
/// for no grid.
inline SurfaceSideGrid surface_side_grid(Vec3 lo, Vec3 hi, float distance, bool any_point) {
  SurfaceSideGrid box;
  if (!any_point || !(distance > 0.0f)) return box;
  box.cell_size = distance / static_cast<float>(kSurfaceSideSteps);
  box.inverse_cell_size = 1.0f / box.cell_size;
  constexpr std::int32_t kSpare = 2;
  // Cells clamp far beyond the range in which differences of 32-bit cell numbers are exact.
  constexpr double kFarCell = 1e9, kMaxCell = 8e8;
  // In double: the box of a cloud may exceed the range of cell numbers.
  const float low[3] = {lo.x, lo.y, lo.z}, high[3] = {hi.x, hi.y, hi.z};
  double first[3], size[3], cells = 1;
  bool countable = true;
  for (int k = 0; k < 3; ++k) {
    const auto cell = [&](float v) {
      const double c = static_cast<double>(v) * static_cast<double>(box.inverse_cell_size);
      return static_cast<double>(static_cast<std::int64_t>(c < -kFarCell  ? -kFarCell
                                                           : c > kFarCell ? kFarCell
                                                                          : c));
    };
    // Two spare steps on either side for rounding.
    first[k] = cell(low[k]) - (kSurfaceSideSteps + kSpare);
    size[k] = cell(high[k]) + (kSurfaceSideSteps + kSpare) - first[k] + 1;
    if (k == 0)
      size[k] =
          static_cast<double>(kCellsPerSurfaceSideWord) *
          static_cast<double>(static_cast<std::int64_t>(size[k] / kCellsPerSurfaceSideWord) + 1);
    cells *= size[k];
    countable = countable && first[k] > -kMaxCell && first[k] + size[k] < kMaxCell;
  }
  if (!countable || cells > static_cast<double>(limits::kMaxSurfaceSideCells)) return box;
  box.first = {static_cast<std::int32_t>(first[0]), static_cast<std::int32_t>(first[1]),
               static_cast<std::int32_t>(first[2])};
  box.words_x = static_cast<std::uint32_t>(size[0]) / kCellsPerSurfaceSideWord;
  box.ny = static_cast<std::uint32_t>(size[1]);
  box.nz = static_cast<std::uint32_t>(size[2]);
  return box;
}

/// Word and shift of a location's four bits; word kNoValue: outside the grid.
struct SurfaceSideCell {
  std::uint32_t word, shift;
};

GPUREG_HD SurfaceSideCell surface_side_cell(const SurfaceSideGrid& box, Vec3 q) {
  const float fx = q.x * box.inverse_cell_size, fy = q.y * box.inverse_cell_size,
              fz = q.z * box.inverse_cell_size;
  constexpr float limit = 1e9f;  // within int32, beyond every grid
  if (!(fx > -limit && fx < limit && fy > -limit && fy < limit && fz > -limit && fz < limit))
    return {kNoValue, 0};
  const std::uint32_t x = static_cast<std::uint32_t>(floor_to_int(fx) - box.first.x),
                      y = static_cast<std::uint32_t>(floor_to_int(fy) - box.first.y),
                      z = static_cast<std::uint32_t>(floor_to_int(fz) - box.first.z);
  if (x / kCellsPerSurfaceSideWord >= box.words_x || y >= box.ny || z >= box.nz)
    return {kNoValue, 0};
  return {(z * box.ny + y) * box.words_x + x / kCellsPerSurfaceSideWord,
          4 * (x % kCellsPerSurfaceSideWord)};
}

/// Bits of SurfaceSide at a location; 0 where nothing is known.
GPUREG_HD std::uint32_t surface_side_at(const SurfaceSideView& surface_sides, Vec3 q) {
  const SurfaceSideCell cell = surface_side_cell(surface_sides.box, q);
  return cell.word == kNoValue ? 0u : (surface_sides.words[cell.word] >> cell.shift) & 15u;
}

/// Calls mark(word, bits) for the cells along a normal (side 0, in front) or against it (side 1,
/// behind), up to the next surface. Requires that the cells on surfaces are marked.
template <typename Mark>
GPUREG_HD void march_surface_side(const SurfaceSideGrid& box, const std::uint32_t* words,
                                  Vec3 point, Vec3 normal, std::uint32_t side, Mark&& mark) {
  if (is_zero(normal)) return;
  const float sign = side == 0 ? box.cell_size : -box.cell_size;
  // The first step would mostly be in the surface's own cells.
  for (std::int32_t step = 2; step <= kSurfaceSideSteps; ++step) {
    const float h = sign * static_cast<float>(step);
    const SurfaceSideCell cell = surface_side_cell(
        box, {fmaf(normal.x, h, point.x), fmaf(normal.y, h, point.y), fmaf(normal.z, h, point.z)});
    if (cell.word == kNoValue || (words[cell.word] >> cell.shift & kOnSurface) != 0) return;
    const std::uint32_t bits = side == 1                 ? kBehind
                               : step <= kFrontNearSteps ? kFrontNear
                                                         : kFrontFar;
    mark(cell.word, bits << cell.shift);
  }
}

}  // namespace gpureg
