// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/compatibility/sort_matches.hpp"
#include "cuda/device/launch.cuh"
#include "cuda/device/warp.cuh"

namespace gpureg::cuda {
namespace {

struct SortBatch {
  const std::uint32_t *offset, *found;
  std::uint64_t* key;
  std::uint32_t* place;
};

constexpr int kSortThreads = 1024, kSortItems = 12;
constexpr std::uint32_t kMostSorted = kSortThreads * kSortItems, kBuckets = 4 * kSortThreads;
constexpr int kBucketShift = 20;  // of an order, whose values are random
static_assert(kBuckets == 1u << (32 - kBucketShift), "an order has a bucket");

/// Results of pair blockIdx.x that are kept, by order, then by place: sorted in shared memory by
/// buckets of a few.
__global__ void __launch_bounds__(kSortThreads) sort_by_buckets(SortBatch b) {
  extern __shared__ std::uint64_t item[];  // order << 32 | place
  __shared__ std::uint32_t start[kBuckets], warp_sum_of[kSortThreads / 32];
  const std::uint32_t p = blockIdx.x, offset = b.offset[p], size = b.offset[p + 1] - offset,
                      lane = threadIdx.x % 32;
  const auto key_at = [&](int i, std::uint32_t& place) {
    place = static_cast<std::uint32_t>(i) * kSortThreads + threadIdx.x;
    return place < size ? b.key[offset + place] : ~std::uint64_t(0);
  };
  const auto is_kept = [](std::uint64_t key) { return (key >> 32 & 1) == 0; };
  for (std::uint32_t k = threadIdx.x; k < kBuckets; k += kSortThreads) start[k] = 0;
  __syncthreads();
  std::uint32_t slot[kSortItems], place;
#pragma unroll
  for (int i = 0; i < kSortItems; ++i) {
    const std::uint64_t key = key_at(i, place);
    if (is_kept(key))
      slot[i] = atomicAdd(start + (static_cast<std::uint32_t>(key) >> kBucketShift), 1u);
  }
  __syncthreads();
  // Four buckets a thread: counts to starts.
  std::uint32_t count[4], mine = 0;
#pragma unroll
  for (int k = 0; k < 4; ++k) mine += count[k] = start[4 * threadIdx.x + k];
  std::uint32_t before = warp_prefix_sum(mine);
  if (lane == 31) warp_sum_of[threadIdx.x / 32] = before;
  __syncthreads();
  before -= mine;
  for (std::uint32_t w = 0; w < threadIdx.x / 32; ++w) before += warp_sum_of[w];
  const std::uint32_t first = before;
#pragma unroll
  for (int k = 0; k < 4; ++k) {
    start[4 * threadIdx.x + k] = before;
    before += count[k];
  }
  __syncthreads();
#pragma unroll
  for (int i = 0; i < kSortItems; ++i) {
    const std::uint64_t key = key_at(i, place);
    if (is_kept(key))
      item[start[static_cast<std::uint32_t>(key) >> kBucketShift] + slot[i]] = key << 32 | place;
  }
  __syncthreads();
  // The buckets of a thread lie one after another, so it sorts all of them at once.
  for (std::uint32_t i = first + 1; i < before; ++i) {
    const std::uint64_t one = item[i];
    std::uint32_t to = i;
    for (; to > first && item[to - 1] > one; --to) item[to] = item[to - 1];
    item[to] = one;
  }
  __syncthreads();
  for (std::uint32_t k = threadIdx.x; k < b.found[p]; k += kSortThreads) {
    b.key[offset + k] = static_cast<std::uint64_t>(p) << 33 | item[k] >> 32;
    b.place[offset + k] = static_cast<std::uint32_t>(item[k]);
  }
}

}  // namespace

bool sort_matches(Exec& exec, const Segments& segments, const std::uint32_t* found,
                  std::uint64_t* key, std::uint32_t* place) {
  constexpr std::size_t kBytes = kMostSorted * sizeof(std::uint64_t);
  if (segments.largest > kMostSorted || exec.allow_shared_memory(sort_by_buckets) < kBytes)
    return false;
  launch(exec, "sort_by_buckets", sort_by_buckets,
         {static_cast<unsigned>(segments.entries()), kSortThreads, kBytes},
         SortBatch{segments.on_device.data(), found, key, place});
  return true;
}

}  // namespace gpureg::cuda
