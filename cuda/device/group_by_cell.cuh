// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "cuda/device/cell_range.hpp"
#include "cuda/device/device_algorithms.hpp"
#include "cuda/device/launch.cuh"
#include "cuda/device/segments.hpp"

/// Groups the elements of every entry of a batch by cell, with one sort for the whole batch and
/// keys of only as many bits as the cells need.
namespace gpureg::cuda {

/// Packing of (entry, cell) into one word that sorts by entry, then z, y, x. One bit above the cell
/// marks elements without a cell.
struct KeyPacking {
  const Cell* lo = nullptr;
  int y_shift = 0, z_shift = 0, entry_shift = 0;
  int bits = 0;

  __device__ std::uint64_t operator()(std::uint32_t entry, Cell c) const {
    const Cell base = lo[entry];
    return (entry_shift < 64 ? static_cast<std::uint64_t>(entry) << entry_shift : 0) |
           static_cast<std::uint64_t>(static_cast<std::uint32_t>(c.z - base.z)) << z_shift |
           static_cast<std::uint64_t>(static_cast<std::uint32_t>(c.y - base.y)) << y_shift |
           static_cast<std::uint64_t>(static_cast<std::uint32_t>(c.x - base.x));
  }
  __device__ std::uint64_t none(std::uint32_t entry) const {
    return (entry_shift < 64 ? static_cast<std::uint64_t>(entry) << entry_shift : 0) |
           std::uint64_t(1) << (entry_shift - 1);
  }
  __device__ bool is_none(std::uint64_t key) const { return (key >> (entry_shift - 1)) & 1; }
};

/// Groups of elements that share a cell, in order of entry, z, y, x; elements of a group keep their
/// order.
struct Groups {
  DeviceBuffer<std::uint32_t> item;  ///< index within the entry, one per sorted position
  DeviceBuffer<std::uint32_t>
      rank;  ///< total + 1: number of groups that begin before a sorted position
  DeviceBuffer<std::uint32_t> start;  ///< first sorted position of each group
};

namespace detail {

template <typename Key, typename CellOf>
__global__ void write_keys(const std::uint32_t* offset, KeyPacking packing, CellOf cell_of_item,
                           Key* keys, std::uint32_t* item) {
  const std::uint32_t entry = blockIdx.y, begin = offset[entry], size = offset[entry + 1] - begin;
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < size;
       i += gridDim.x * blockDim.x) {
    Cell cell;
    keys[begin + i] =
        static_cast<Key>(cell_of_item(entry, i, cell) ? packing(entry, cell) : packing.none(entry));
    item[begin + i] = i;
  }
}

template <typename Key>
__global__ void mark_heads(const std::uint32_t* offset, KeyPacking packing, const Key* keys,
                           std::uint32_t* head) {
  const std::uint32_t entry = blockIdx.y, begin = offset[entry], end = offset[entry + 1];
  for (std::uint32_t i = begin + blockIdx.x * blockDim.x + threadIdx.x; i < end;
       i += gridDim.x * blockDim.x) {
    const Key key = keys[i];
    head[i] = !packing.is_none(key) && (i == begin || key != keys[i - 1]);
  }
  if (entry + 1 == gridDim.y && blockIdx.x == 0 && threadIdx.x == 0) head[end] = 0;
}

/// start[rank] of every group, from the ranks.
void write_group_starts(Exec& exec, std::uint32_t total, Groups& groups);

template <typename Key, typename CellOf>
Groups group(Exec& exec, const Segments& segments, const KeyPacking& packing, bool one_sort,
             CellOf cell_of_item) {
  constexpr unsigned kThreads = 256;
  const std::uint32_t total = segments.total();
  const dim3 grid(std::max(1u, std::min(blocks_for(segments.largest, kThreads), 1024u)),
                  static_cast<unsigned>(segments.entries()));
  auto keys = exec.buffer<Key>(total);
  Groups out;
  out.item = exec.buffer<std::uint32_t>(total);
  launch(exec, "write_keys", write_keys<Key, CellOf>, {grid, kThreads}, segments.on_device.data(),
         packing, cell_of_item, keys.data(), out.item.data());
  if (one_sort) {
    sort_pairs(exec, keys, out.item, packing.bits);
  } else if constexpr (sizeof(Key) == 8) {
    for (std::size_t e = 0; e < segments.entries(); ++e)
      sort_pairs_in_place(exec, keys.data() + segments.offset[e],
                          out.item.data() + segments.offset[e], segments.size(e), packing.bits);
  }
  out.rank = exec.buffer<std::uint32_t>(total + 1);
  launch(exec, "mark_heads", mark_heads<Key>, {grid, kThreads}, segments.on_device.data(), packing,
         keys.data(), out.rank.data());
  exclusive_sum(exec, out.rank.data(), out.rank.data(), total + 1);
  out.start = exec.buffer<std::uint32_t>(total);
  write_group_starts(exec, total, out);
  return out;
}

}  // namespace detail

/// cell_of_item(entry, item, cell&) on the device: sets the cell of an element, or returns false
/// where it has none. ranges: cells that entries may use.
template <typename CellOf>
Groups group_by_cell(Exec& exec, const Segments& segments, const std::vector<CellRange>& ranges,
                     CellOf cell_of_item) {
  std::vector<Cell> lo;
  std::uint64_t nx = 1, ny = 1, nz = 1;
  for (const CellRange& r : ranges) {
    lo.push_back(r.lo);
    nx = std::max(nx, static_cast<std::uint64_t>(static_cast<std::int64_t>(r.hi.x) - r.lo.x + 1));
    ny = std::max(ny, static_cast<std::uint64_t>(static_cast<std::int64_t>(r.hi.y) - r.lo.y + 1));
    nz = std::max(nz, static_cast<std::uint64_t>(static_cast<std::int64_t>(r.hi.z) - r.lo.z + 1));
  }
  const auto lo_on_device = exec.upload(lo);
  KeyPacking packing;
  packing.lo = lo_on_device.data();
  packing.y_shift = bits_for(nx);
  packing.z_shift = packing.y_shift + bits_for(ny);
  packing.entry_shift = packing.z_shift + bits_for(nz) + 1;
  packing.bits = packing.entry_shift + bits_for(segments.entries());
  if (packing.bits <= 32)
    return detail::group<std::uint32_t>(exec, segments, packing, true, cell_of_item);
  if (packing.bits <= 64)
    return detail::group<std::uint64_t>(exec, segments, packing, true, cell_of_item);
  // The key has no bits left for the entry, so each entry is sorted alone.
  packing.bits = packing.entry_shift;
  packing.entry_shift = packing.entry_shift < 64 ? packing.entry_shift : 64;
  return detail::group<std::uint64_t>(exec, segments, packing, false, cell_of_item);
}

/// Number of groups before each entry: entries + 1 numbers, there after the next synchronize().
const std::uint32_t* download_group_offsets(Exec& exec, const Segments& segments,
                                            const Groups& groups);

}  // namespace gpureg::cuda
