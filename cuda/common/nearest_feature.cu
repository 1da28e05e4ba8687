// SPDX-License-Identifier: BSD-3-Clause
#include "cuda/common/nearest_feature.hpp"

#include <algorithm>

#include "algorithm/cell.hpp"
#include "cuda/device/launch.cuh"

namespace gpureg::cuda {
namespace {

constexpr int kThreads = 256;
constexpr int kQueries = 64, kRows = 128;  // tile of a thread block
constexpr int kDims = 16;                  // dimensions in shared memory at a time
constexpr int kPerThreadQ = 4, kPerThreadR = 8;
constexpr unsigned long long kNone = ~0ull;

/// Distance and index in one word, ordered by distance, then by index.
__device__ unsigned long long packed(float distance, std::uint32_t index) {
  return static_cast<unsigned long long>(__float_as_uint(distance)) << 32 | index;
}

/// k = 1. Thread blocks (x: queries, y: part of the rows, z: pair) fold their best into `best` by
/// atomicMin.
__global__ void __launch_bounds__(kThreads)
    nearest_one(const FeatureQuery* batch, std::uint32_t rows_per_part, unsigned long long* best) {
  __shared__ float q_tile[kDims][kQueries + 4];
  __shared__ float r_tile[kDims][kRows + 4];
  const FeatureQuery f = batch[blockIdx.z];
  const std::uint32_t q_begin = blockIdx.x * kQueries, stride = row_stride(f.dimension);
  const std::uint32_t r_first = blockIdx.y * rows_per_part,
                      r_last = min(f.row_count, r_first + rows_per_part);
  if (q_begin >= f.query_count || r_first >= f.row_count) return;
  const int tq = static_cast<int>(threadIdx.x) / 16, tr = static_cast<int>(threadIdx.x) % 16;
  unsigned long long mine[kPerThreadQ];
  for (int a = 0; a < kPerThreadQ; ++a) mine[a] = kNone;
  for (std::uint32_t r_begin = r_first; r_begin < r_last; r_begin += kRows) {
    float sum[kPerThreadQ][kPerThreadR];
#pragma unroll
    for (int a = 0; a < kPerThreadQ; ++a)
#pragma unroll
      for (int b = 0; b < kPerThreadR; ++b) sum[a][b] = 0.0f;
    for (std::uint32_t d0 = 0; d0 < f.dimension; d0 += kDims) {
      const int dims = static_cast<int>(min(static_cast<std::uint32_t>(kDims), f.dimension - d0));
      __syncthreads();
      for (int k = static_cast<int>(threadIdx.x); k < kQueries * kDims; k += kThreads) {
        const int row = k / kDims, d = k % kDims;
        const std::uint32_t q = q_begin + static_cast<std::uint32_t>(row);
        if (d < dims)
          q_tile[d][row] =
              q < f.query_count ? f.queries[std::size_t(f.row_of(q)) * stride + d0 + d] : 0.0f;
      }
      for (int k = static_cast<int>(threadIdx.x); k < kRows * kDims; k += kThreads) {
        const int row = k / kDims, d = k % kDims;
        const std::uint32_t r = r_begin + static_cast<std::uint32_t>(row);
        if (d < dims)
          r_tile[d][row] =
              r < r_last ? f.rows[static_cast<std::size_t>(r) * stride + d0 + d] : 0.0f;
      }
      __syncthreads();
      for (int d = 0; d < dims; ++d) {
        float q[kPerThreadQ], r[kPerThreadR];
#pragma unroll
        for (int a = 0; a < kPerThreadQ; ++a) q[a] = q_tile[d][tq * kPerThreadQ + a];
#pragma unroll
        for (int b = 0; b < kPerThreadR; ++b) r[b] = r_tile[d][tr + 16 * b];
#pragma unroll
        for (int a = 0; a < kPerThreadQ; ++a)
#pragma unroll
          for (int b = 0; b < kPerThreadR; ++b) {
            const float difference = q[a] - r[b];
            sum[a][b] = fmaf(difference, difference, sum[a][b]);
          }
      }
    }
#pragma unroll
    for (int b = 0; b < kPerThreadR; ++b) {
      const std::uint32_t r = r_begin + static_cast<std::uint32_t>(tr + 16 * b);
      if (r >= r_last || !f.row_valid[r]) continue;
#pragma unroll
      for (int a = 0; a < kPerThreadQ; ++a)
        if (sum[a][b] < __uint_as_float(0x7f800000u)) mine[a] = min(mine[a], packed(sum[a][b], r));
    }
  }
  for (int a = 0; a < kPerThreadQ; ++a) {
    for (int step = 8; step > 0; step /= 2)
      mine[a] = min(mine[a], __shfl_xor_sync(~0u, mine[a], step));
    const std::uint32_t q = q_begin + static_cast<std::uint32_t>(tq * kPerThreadQ + a);
    if (tr == 0 && q < f.query_count && mine[a] != kNone) atomicMin(best + f.out + q, mine[a]);
  }
}

__global__ void unpack_nearest(const FeatureQuery* batch, const unsigned long long* best,
                               std::uint32_t* out) {
  const FeatureQuery f = batch[blockIdx.y];
  const std::uint32_t q = blockIdx.x * blockDim.x + threadIdx.x;
  if (q < f.query_count)
    out[f.out + q] =
        f.query_valid[f.row_of(q)] ? static_cast<std::uint32_t>(best[f.out + q]) : kNoValue;
}

/// Any k up to limits::kMaxNeighbors: a warp per query. Every lane keeps the best of its rows, then
/// the lists of the lanes are merged.
__global__ void __launch_bounds__(128)
    nearest_many(const FeatureQuery* batch, std::uint32_t k, std::uint32_t* out) {
  const FeatureQuery f = batch[blockIdx.y];
  const std::uint32_t q = blockIdx.x * 4 + threadIdx.x / 32, lane = threadIdx.x % 32;
  if (q >= f.query_count) return;
  const std::uint32_t stride = row_stride(f.dimension);
  const float* query = f.queries + static_cast<std::size_t>(f.row_of(q)) * stride;
  unsigned long long best[limits::kMaxNeighbors];
  for (auto& b : best) b = kNone;
  for (std::uint32_t r = lane; r < f.row_count; r += 32) {
    if (!f.row_valid[r]) continue;
    const float* row = f.rows + static_cast<std::size_t>(r) * stride;
    float sum = 0.0f;
    for (std::uint32_t d = 0; d < f.dimension; ++d) {
      const float difference = query[d] - row[d];
      sum = fmaf(difference, difference, sum);
    }
    if (!(sum < __uint_as_float(0x7f800000u))) continue;
    unsigned long long moving = packed(sum, r);
    // Unrolled insertion keeps the list in registers.
#pragma unroll
    for (std::uint32_t t = 0; t < limits::kMaxNeighbors; ++t) {
      const unsigned long long other = best[t];
      best[t] = min(other, moving);
      moving = max(other, moving);
    }
  }
  std::uint32_t taken = 0;
  for (std::uint32_t t = 0; t < k; ++t) {
    // The smallest head of the lists is the next result; its lane advances.
    unsigned long long head = kNone;
#pragma unroll
    for (std::uint32_t s = 0; s < limits::kMaxNeighbors; ++s)
      if (s == taken) head = best[s];
    unsigned long long least = head;
    for (int step = 16; step > 0; step /= 2) least = min(least, __shfl_xor_sync(~0u, least, step));
    if (head == least && head != kNone) ++taken;
    if (lane == 0)
      out[f.out + static_cast<std::size_t>(q) * k + t] =
          f.query_valid[f.row_of(q)] ? static_cast<std::uint32_t>(least) : kNoValue;
  }
}

}  // namespace

std::uint32_t rows_of_part(const Exec& exec, std::size_t query_blocks, std::uint32_t most_rows,
                           std::uint32_t tile) {
  const std::size_t tiles = blocks_for(most_rows, tile),
                    wanted = static_cast<std::size_t>(exec.multiprocessors()) * 4;
  const std::size_t parts = std::max<std::size_t>(1, std::min(tiles, wanted / query_blocks));
  return blocks_for(tiles, static_cast<unsigned>(parts)) * tile;
}

DeviceBuffer<std::uint32_t> nearest_features(Exec& exec, const std::vector<FeatureQuery>& queries,
                                             std::uint32_t k, std::size_t answers) {
  auto out = exec.buffer<std::uint32_t>(answers);
  if (answers == 0) return out;
  const auto batch = exec.upload(queries);
  std::uint32_t most_queries = 0, most_rows = 0;
  for (const FeatureQuery& f : queries) {
    most_queries = std::max(most_queries, f.query_count);
    most_rows = std::max(most_rows, f.row_count);
  }
  const unsigned entries = static_cast<unsigned>(queries.size());
  if (k > 1) {
    launch(exec, "nearest_many", nearest_many, {{blocks_for(most_queries, 4), entries}, 128},
           batch.data(), k, out.data());
    return out;
  }
  // All bits set is greater than every result, and its index is kNoValue.
  auto best = exec.filled<unsigned long long>(answers, 0xff);
  bool filterable = has_filter(exec);
  for (const FeatureQuery& f : queries)
    filterable = filterable && f.query_half && f.row_half && f.dimension == queries[0].dimension &&
                 f.copy == queries[0].copy;
  if (filterable) {
    filter_nearest(exec, batch.data(), entries, most_queries, most_rows, queries[0].dimension,
                   queries[0].copy, answers, best.data());
  } else {
    const std::uint32_t rows_per_part = rows_of_part(
        exec, blocks_for(most_queries, kQueries) * std::size_t(entries), most_rows, kRows);
    launch(exec, "nearest_one", nearest_one,
           {{blocks_for(most_queries, kQueries), blocks_for(most_rows, rows_per_part), entries},
            kThreads},
           batch.data(), rows_per_part, best.data());
  }
  launch(exec, "unpack_nearest", unpack_nearest, shape_for(most_queries, 256, entries),
         batch.data(), best.data(), out.data());
  return out;
}

}  // namespace gpureg::cuda
