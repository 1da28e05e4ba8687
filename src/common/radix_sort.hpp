// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace gpureg {

/// Bits that sort like the number, which is none of NaN.
inline std::uint32_t sortable_bits(float value) {
  value += 0.0f;  // -0 becomes 0
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  return bits & 0x80000000u ? ~bits : bits | 0x80000000u;
}

struct KeyIndex {
  std::uint64_t key;
  std::uint32_t index;
};

/// Stable least-significant-digit radix sort by key(item), 64 bits; skips digits that are equal in
/// all keys.
template <typename Item, typename Key>
void radix_sort(std::vector<Item>& items, const Key& key) {
  constexpr int kBits = 11;
  constexpr std::uint32_t kBuckets = 1u << kBits;
  std::uint64_t all_or = 0, all_and = ~std::uint64_t(0);
  for (const Item& item : items) {
    all_or |= key(item);
    all_and &= key(item);
  }
  const std::uint64_t varying = all_or ^ all_and;
  std::vector<Item> other(items.size());
  for (int shift = 0; shift < 64; shift += kBits) {
    if (((varying >> shift) & (kBuckets - 1)) == 0) continue;
    std::uint32_t start[kBuckets] = {0};
    for (const Item& item : items) ++start[(key(item) >> shift) & (kBuckets - 1)];
    std::uint32_t sum = 0;
    for (std::uint32_t& s : start) {
      const std::uint32_t n = s;
      s = sum;
      sum += n;
    }
    for (const Item& item : items) other[start[(key(item) >> shift) & (kBuckets - 1)]++] = item;
    items.swap(other);
  }
}

inline void radix_sort(std::vector<KeyIndex>& items) {
  radix_sort(items, [](const KeyIndex& item) { return item.key; });
}

}  // namespace gpureg
