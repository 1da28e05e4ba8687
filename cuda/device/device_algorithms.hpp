// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/device/segments.hpp"

/// Wrappers of the device-wide algorithms of CUB, compiled once.
namespace gpureg::cuda {

/// A number of elements as CUB takes it. Throws InvalidArgument where it does not fit.
int cub_size(std::size_t size);

/// Bits of the numbers below `values`.
inline int bits_for(std::uint64_t values) {
  int bits = 0;
  while (bits < 64 && (std::uint64_t(1) << bits) < values) ++bits;
  return bits;
}

/// Stable sort of (key, value) pairs by the lowest `bits` bits of the key. The buffers may be
/// swapped for others.
void sort_pairs(Exec& exec, DeviceBuffer<std::uint32_t>& keys, DeviceBuffer<std::uint32_t>& values,
                int bits);
void sort_pairs(Exec& exec, DeviceBuffer<std::uint64_t>& keys, DeviceBuffer<std::uint32_t>& values,
                int bits);
/// The same for each segment by itself. Where they do not fit a thread block each, the keys need
/// the number of their segment above `bits`.
void sort_segments(Exec& exec, DeviceBuffer<std::uint64_t>& keys,
                   DeviceBuffer<std::uint32_t>& values, const Segments& segments, int bits);
/// The same for the elements [begin, end) only.
void sort_pairs_in_place(Exec& exec, std::uint64_t* keys, std::uint32_t* values, std::size_t size,
                         int bits);

/// out[k] = in[0] + ... + in[k - 1]; out may be in.
void exclusive_sum(Exec& exec, const std::uint32_t* in, std::uint32_t* out, std::size_t size);

}  // namespace gpureg::cuda
