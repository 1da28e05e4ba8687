// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/limits.hpp"
#include "math/span.hpp"
#include "math/vec3.hpp"

namespace gpureg {

/// Integer cell of a regular grid. Keys pack it into one sortable word: z, y, x with kCellBits bits
/// each.
struct Cell {
  std::int32_t x, y, z;
};

/// Added to coordinates in keys: cells range from -kCellBias to kCellBias - 1 along each axis.
constexpr std::int32_t kCellBias = limits::kMaxCells;
constexpr std::uint64_t kEmptyKey = ~std::uint64_t(0);

GPUREG_HD std::int32_t floor_to_int(float v) {
  const std::int32_t i = static_cast<std::int32_t>(v);
  return i - (static_cast<float>(i) > v ? 1 : 0);
}

GPUREG_HD Cell cell_of(Vec3 p, float inverse_size) {
  return {floor_to_int(p.x * inverse_size), floor_to_int(p.y * inverse_size),
          floor_to_int(p.z * inverse_size)};
}

GPUREG_HD std::uint64_t cell_key(Cell c) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(c.z + kCellBias))
          << (2 * limits::kCellBits)) |
         (static_cast<std::uint64_t>(static_cast<std::uint32_t>(c.y + kCellBias))
          << limits::kCellBits) |
         static_cast<std::uint64_t>(static_cast<std::uint32_t>(c.x + kCellBias));
}

GPUREG_HD Cell cell_from_key(std::uint64_t key) {
  const std::uint64_t mask = (std::uint64_t(1) << limits::kCellBits) - 1;
  return {static_cast<std::int32_t>(key & mask) - kCellBias,
          static_cast<std::int32_t>((key >> limits::kCellBits) & mask) - kCellBias,
          static_cast<std::int32_t>((key >> (2 * limits::kCellBits)) & mask) - kCellBias};
}

/// True where the cell is inside the range that keys can hold.
GPUREG_HD bool in_key_range(Cell c) {
  return c.x >= -kCellBias && c.x < kCellBias && c.y >= -kCellBias && c.y < kCellBias &&
         c.z >= -kCellBias && c.z < kCellBias;
}

/// Entry of an open-addressing table from cell keys to indices. The slot of a key depends on the
/// order of insertion, the result of a look-up does not; the table may be filled in parallel.
struct CellEntry {
  std::uint64_t key;
  std::uint32_t value;
  std::uint32_t unused;
};

constexpr std::uint32_t kNoValue = ~std::uint32_t(0);

GPUREG_HD std::uint32_t cell_slot(std::uint64_t key, std::uint32_t mask) {
  const std::uint64_t h = key * 0x9E3779B97F4A7C15ull;
  return static_cast<std::uint32_t>(h >> 32) & mask;
}

/// Value of a key in a table of power-of-two size with at least one empty slot, or kNoValue.
GPUREG_HD std::uint32_t find_cell(Span<const CellEntry> table, std::uint64_t key) {
  const std::uint32_t mask = static_cast<std::uint32_t>(table.size) - 1;
  for (std::uint32_t slot = cell_slot(key, mask);; slot = (slot + 1) & mask) {
    const CellEntry entry = table.data[slot];
    if (entry.key == key) return entry.value;
    if (entry.key == kEmptyKey) return kNoValue;
  }
}

}  // namespace gpureg
