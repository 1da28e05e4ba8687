// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/device/device_algorithms.hpp"

#include <cub/block/block_radix_sort.cuh>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include <limits>
#include <string>

#include "common/in_halves.hpp"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {

int cub_size(std::size_t size) {
  if (size > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    throw BatchTooLarge("a batch of " + std::to_string(size) +
                        " elements exceeds 2^31 - 1: split it");
  return static_cast<int>(size);
}

namespace {

template <typename Key>
void sort(Exec& exec, cub::DoubleBuffer<Key>& keys, cub::DoubleBuffer<std::uint32_t>& values,
          std::size_t size, int bits) {
  std::size_t bytes = 0;
  check(cub::DeviceRadixSort::SortPairs(nullptr, bytes, keys, values, cub_size(size), 0, bits,
                                        exec.stream()),
        "radix sort");
  const auto scratch = exec.buffer<char>(bytes);
  check(cub::DeviceRadixSort::SortPairs(scratch.data(), bytes, keys, values, cub_size(size), 0,
                                        bits, exec.stream()),
        "radix sort");
}

template <typename Key>
void sort_buffers(Exec& exec, DeviceBuffer<Key>& keys, DeviceBuffer<std::uint32_t>& values,
                  int bits) {
  if (keys.size() == 0) return;
  auto other_keys = exec.buffer<Key>(keys.size());
  auto other_values = exec.buffer<std::uint32_t>(values.size());
  cub::DoubleBuffer<Key> k(keys.data(), other_keys.data());
  cub::DoubleBuffer<std::uint32_t> v(values.data(), other_values.data());
  sort(exec, k, v, keys.size(), bits);
  if (k.Current() != keys.data()) keys = std::move(other_keys);
  if (v.Current() != values.data()) values = std::move(other_values);
}

constexpr int kSortThreads = 1024, kItems = 8;
using SortInBlock = cub::BlockRadixSort<std::uint64_t, kSortThreads, kItems, std::uint32_t>;

/// A thread block per segment.
__global__ void __launch_bounds__(kSortThreads)
    sort_in_block(const std::uint32_t* offset, int bits, std::uint64_t* keys,
                  std::uint32_t* values) {
  extern __shared__ __align__(16) char shared[];
  const std::uint32_t begin = offset[blockIdx.x], size = offset[blockIdx.x + 1] - begin;
  std::uint64_t key[kItems];
  std::uint32_t value[kItems];
#pragma unroll
  for (int k = 0; k < kItems; ++k) {
    const std::uint32_t at = threadIdx.x * kItems + static_cast<std::uint32_t>(k);
    key[k] = at < size ? keys[begin + at] : ~std::uint64_t(0);
    value[k] = at < size ? values[begin + at] : 0u;
  }
  SortInBlock(*reinterpret_cast<SortInBlock::TempStorage*>(shared))
      .SortBlockedToStriped(key, value, 0, bits);
#pragma unroll
  for (int k = 0; k < kItems; ++k) {
    const std::uint32_t at = static_cast<std::uint32_t>(k) * kSortThreads + threadIdx.x;
    if (at >= size) continue;
    keys[begin + at] = key[k];
    values[begin + at] = value[k];
  }
}

}  // namespace

void sort_segments(Exec& exec, DeviceBuffer<std::uint64_t>& keys,
                   DeviceBuffer<std::uint32_t>& values, const Segments& segments, int bits) {
  constexpr std::size_t kBytes = sizeof(SortInBlock::TempStorage);
  if (segments.largest > kSortThreads * kItems || exec.allow_shared_memory(sort_in_block) < kBytes)
    return sort_pairs(exec, keys, values, bits + bits_for(segments.entries()));
  launch(exec, "sort_in_block", sort_in_block,
         {static_cast<unsigned>(segments.entries()), kSortThreads, kBytes},
         segments.on_device.data(), bits, keys.data(), values.data());
}

void sort_pairs(Exec& exec, DeviceBuffer<std::uint32_t>& keys, DeviceBuffer<std::uint32_t>& values,
                int bits) {
  sort_buffers(exec, keys, values, bits);
}

void sort_pairs(Exec& exec, DeviceBuffer<std::uint64_t>& keys, DeviceBuffer<std::uint32_t>& values,
                int bits) {
  sort_buffers(exec, keys, values, bits);
}

void sort_pairs_in_place(Exec& exec, std::uint64_t* keys, std::uint32_t* values, std::size_t size,
                         int bits) {
  if (size == 0) return;
  const auto other_keys = exec.buffer<std::uint64_t>(size);
  const auto other_values = exec.buffer<std::uint32_t>(size);
  cub::DoubleBuffer<std::uint64_t> k(keys, other_keys.data());
  cub::DoubleBuffer<std::uint32_t> v(values, other_values.data());
  sort(exec, k, v, size, bits);
  if (k.Current() != keys)
    check(cudaMemcpyAsync(keys, k.Current(), size * sizeof(std::uint64_t), cudaMemcpyDeviceToDevice,
                          exec.stream()),
          "cudaMemcpyAsync");
  if (v.Current() != values)
    check(cudaMemcpyAsync(values, v.Current(), size * sizeof(std::uint32_t),
                          cudaMemcpyDeviceToDevice, exec.stream()),
          "cudaMemcpyAsync");
}

void exclusive_sum(Exec& exec, const std::uint32_t* in, std::uint32_t* out, std::size_t size) {
  if (size == 0) return;
  std::size_t bytes = 0;
  check(cub::DeviceScan::ExclusiveSum(nullptr, bytes, in, out, cub_size(size), exec.stream()),
        "scan");
  const auto scratch = exec.buffer<char>(bytes);
  check(
      cub::DeviceScan::ExclusiveSum(scratch.data(), bytes, in, out, cub_size(size), exec.stream()),
      "scan");
}

}  // namespace gpureg::cuda
