// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "common/in_halves.hpp"
#include "cuda/device/exec.hpp"

namespace gpureg::cuda {

/// A batch as one range per entry: the elements of entry e are [offset[e], offset[e + 1]) of every
/// array.
struct Segments {
  std::vector<std::uint32_t> offset;
  DeviceBuffer<std::uint32_t> on_device;
  std::uint32_t largest = 0;

  std::size_t entries() const { return offset.size() - 1; }
  std::uint32_t total() const { return offset.back(); }
  std::uint32_t size(std::size_t entry) const { return offset[entry + 1] - offset[entry]; }
};

/// From the offsets, the first of which is 0.
inline Segments segments_of(Exec& exec, std::vector<std::uint32_t> offset) {
  Segments s;
  s.offset = std::move(offset);
  s.on_device = exec.upload(s.offset);
  for (std::size_t e = 0; e < s.entries(); ++e) s.largest = std::max(s.largest, s.size(e));
  return s;
}

/// Elements of a batch. CUB counts by int, and arrays of ranks have one element more.
constexpr std::uint64_t kMaxElements = 0x7ffffffe;

/// Offsets of entries of size(e) elements. Throws BatchTooLarge where the total exceeds
/// kMaxElements.
template <typename Size>
std::vector<std::uint32_t> batch_offsets(std::size_t entries, Size&& size) {
  std::vector<std::uint32_t> offset{0};
  std::uint64_t sum = 0;
  for (std::size_t e = 0; e < entries; ++e) {
    sum += size(e);
    if (sum > kMaxElements)
      throw BatchTooLarge("a batch of " + std::to_string(sum) +
                          " elements exceeds 2^31 - 2: split it");
    offset.push_back(static_cast<std::uint32_t>(sum));
  }
  return offset;
}

template <typename Size>
Segments make_segments(Exec& exec, std::size_t entries, Size&& size) {
  return segments_of(exec, batch_offsets(entries, size));
}

}  // namespace gpureg::cuda
