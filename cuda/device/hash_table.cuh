// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "algorithm/cell.hpp"

namespace gpureg::cuda {

/// Table size for a number of keys: a power of two with spare entries, as on the CPU.
inline std::size_t table_size(std::size_t keys) {
  std::size_t size = 8;
  while (size < 3 * keys) size *= 2;
  return size;
}

/// Enters a key that is not in the table yet. All entries start as bytes of 0xff. Returns its slot.
template <typename Entry>
__device__ std::uint32_t claim_slot(Entry* table, std::uint32_t size, std::uint64_t key) {
  std::uint32_t slot = cell_slot(key, size - 1);
  while (atomicCAS(reinterpret_cast<unsigned long long*>(&table[slot].key), kEmptyKey, key) !=
         kEmptyKey)
    slot = (slot + 1) & (size - 1);
  return slot;
}

/// The same with a value.
__device__ inline void insert_key(CellEntry* table, std::uint32_t size, std::uint64_t key,
                                  std::uint32_t value) {
  table[claim_slot(table, size, key)].value = value;
}

}  // namespace gpureg::cuda
