// SPDX-License-Identifier: BSD-3-Clause
#include <cuda_fp16.h>
#include <cuda_pipeline.h>

#include <algorithm>

#include "cuda/common/nearest_feature.hpp"
#include "cuda/device/launch.cuh"

// Exact nearest features at the speed of the tensor cores. |q - r|^2 = |q|^2 + |r|^2 - 2 q.r; a
// term of q and a term of r bound the error of rounding q and r to binary16 (product_error()). A
// first pass over every fourth row gives each query an upper bound of its nearest distance. A
// second pass over all rows lists those whose lower bound is not above it (4 of 5,000 for FPFH; 1.2
// if the first pass read all rows). The listed rows are measured by the chain of fmaf that defines
// the distance, so the result has the bits of an exhaustive search.
namespace gpureg::cuda {
namespace {

constexpr int kWarps = 8;
constexpr int kThreads = 32 * kWarps;
/// Keeps the bound of equal features above their rounded distance of zero.
constexpr float kTinySquare = 1e-30f;
constexpr int kTiles = 4;  // of 16 queries, of a warp
constexpr int kQueriesPerWarp = 16 * kTiles;
constexpr int kQueries = kWarps * kQueriesPerWarp;
constexpr int kRows = 64;  // of a tile in shared memory
// of the rows in the first pass: adjacent rows have similar features
constexpr std::uint32_t kStep = 4;
// of the queue of a warp: enough work for every lane
constexpr std::uint32_t kFull = 32;

constexpr int blocks_a_multiprocessor(int steps) { return steps <= 2 ? 3 : 2; }

struct FilterBatch {
  const FeatureQuery* queries;
  std::uint32_t tiles_per_part;
  std::uint32_t step;  // of the rows in a pass
  // per result: smallest upper bound of |r|^2 - 2 q.r, as an ordered integer
  std::int32_t* bound;
  unsigned long long* best;
};

__device__ std::int32_t ordered(float v) {
  const std::int32_t bits = __float_as_int(v);
  return bits ^ ((bits >> 31) & 0x7fffffff);
}
__device__ float from_ordered(std::int32_t v) {
  return __int_as_float(v ^ ((v >> 31) & 0x7fffffff));
}

/// The first architecture with the products below, as Exec::compiled_for() counts.
constexpr int kTensorArchitecture = 80;

#if !defined(__CUDA_ARCH__) || __CUDA_ARCH__ >= 800
/// d = c + a b
__device__ void multiply_add(float (&d)[4], const std::uint32_t (&a)[4], const std::uint32_t* b,
                             const float (&c)[4]) {
  asm("mma.sync.aligned.m16n8k16.row.col.f32.f16.f16.f32 {%0,%1,%2,%3}, {%4,%5,%6,%7}, {%8,%9}, "
      "{%10,%11,%12,%13};"
      : "=f"(d[0]), "=f"(d[1]), "=f"(d[2]), "=f"(d[3])
      : "r"(a[0]), "r"(a[1]), "r"(a[2]), "r"(a[3]), "r"(b[0]), "r"(b[1]), "f"(c[0]), "f"(c[1]),
        "f"(c[2]), "f"(c[3]));
}
#else
// Never launched there, see has_filter().
__device__ void multiply_add(float (&)[4], const std::uint32_t (&)[4], const std::uint32_t*,
                             const float (&)[4]) {}
#endif

/// The lane's parts of 8 rows: b[2 s], b[2 s + 1] for step s. Matrices of 8 rows and 8 columns, of
/// which lane l says where row l % 8 of matrix l / 8 begins.
template <int kSteps>
__device__ void load_rows(std::uint32_t (&b)[2 * kSteps], const std::uint32_t* tile, int stride,
                          int lane) {
  const std::uint32_t* row = tile + lane % 8 * stride + lane / 8 * 4;
#pragma unroll
  for (int s = 0; s + 1 < kSteps; s += 2)
    asm volatile("ldmatrix.sync.aligned.m8n8.x4.shared.b16 {%0,%1,%2,%3}, [%4];"
                 : "=r"(b[2 * s]), "=r"(b[2 * s + 1]), "=r"(b[2 * s + 2]), "=r"(b[2 * s + 3])
                 : "r"(static_cast<std::uint32_t>(__cvta_generic_to_shared(row + s * 8)))
                 : "memory");
  // Addresses of lanes from 16 on do not count.
  if (kSteps % 2 == 1)
    asm volatile("ldmatrix.sync.aligned.m8n8.x2.shared.b16 {%0,%1}, [%2];"
                 : "=r"(b[2 * kSteps - 2]), "=r"(b[2 * kSteps - 1])
                 : "r"(static_cast<std::uint32_t>(__cvta_generic_to_shared(
                     tile + lane % 8 * stride + lane / 8 % 2 * 4 + (kSteps - 1) * 8)))
                 : "memory");
}

/// The distance that defines the result. The zeros at the end of a row change nothing.
template <int kWidth>
__device__ void measure(const FeatureQuery& f, std::uint32_t q, std::uint32_t r,
                        unsigned long long* best) {
  const float4* query =
      reinterpret_cast<const float4*>(f.queries + static_cast<std::size_t>(f.row_of(q)) * kWidth);
  const float4* row =
      reinterpret_cast<const float4*>(f.rows + static_cast<std::size_t>(r) * kWidth);
  float sum = 0.0f;
  const auto add = [&](float a, float b) {
    const float difference = a - b;
    sum = fmaf(difference, difference, sum);
  };
#pragma unroll
  for (int k = 0; k < kWidth / 4; ++k) {
    const float4 a = __ldg(query + k), b = __ldg(row + k);
    add(a.x, b.x);
    add(a.y, b.y);
    add(a.z, b.z);
    add(a.w, b.w);
  }
  if (!(sum < __uint_as_float(0x7f800000u))) return;
  const unsigned long long found = static_cast<unsigned long long>(__float_as_uint(sum)) << 32 | r;
  if (found < best[f.out + q]) atomicMin(best + f.out + q, found);
}

/// Rows within the bounds of the queries of a lane, from one product of 64 queries and 8 rows: bit
/// 2 m + j is query 8 m + lane / 4 and row first_row + 2 (lane % 4) + j.
struct Found {
  std::uint32_t which, lane, first_row;
};

template <int kWidth>
__device__ void measure_found(const FeatureQuery& f, std::uint32_t q_first, Found found,
                              unsigned long long* best) {
  for (; found.which != 0; found.which &= found.which - 1) {
    const auto bit = static_cast<std::uint32_t>(__ffs(static_cast<int>(found.which)) - 1);
    measure<kWidth>(f, q_first + bit / 2 * 8 + found.lane / 4,
                    found.first_row + found.lane % 4 * 2 + bit % 2, best);
  }
}

/// kSteps: dimensions of the copies over 16; kWidth: of the rows that are measured. First pass
/// (kCollect false): bounds; second: the rows within them. Blocks: x queries, y part of the rows, z
/// entry.
template <int kSteps, int kWidth, HalfCopy kCopy, bool kCollect>
__global__ void __launch_bounds__(kThreads, blocks_a_multiprocessor(kSteps))
    filter(FilterBatch batch) {
  // 8 rows begin in 8 different quarters of the banks
  constexpr int kWords = kSteps * 8, kStride = kWords + 4;
  constexpr float kInfinity = 3.402823466e38f * 2.0f;
  __shared__ __align__(16) std::uint32_t tile[2][kRows * kStride];
  __shared__ __align__(16) float square[2][kRows];
  __shared__ Found queue[kCollect ? kWarps : 1][2 * kFull];
  const FeatureQuery f = batch.queries[blockIdx.z];
  const std::uint32_t tiles = (f.row_count + kRows * batch.step - 1) / (kRows * batch.step);
  const std::uint32_t first_tile = blockIdx.y * batch.tiles_per_part,
                      end_tile = min(tiles, first_tile + batch.tiles_per_part);
  if (blockIdx.x * kQueries >= f.query_count || first_tile >= tiles) return;
  const int warp = static_cast<int>(threadIdx.x / 32), lane = static_cast<int>(threadIdx.x % 32),
            row_of_lane = lane / 4, k_of_lane = lane % 4;
  const std::uint32_t q_first =
      blockIdx.x * kQueries + static_cast<std::uint32_t>(warp * kQueriesPerWarp);
  std::uint32_t queued = 0;

  const auto fetch = [&](std::uint32_t row_tile, int buffer) {
    for (int k = static_cast<int>(threadIdx.x); k < kRows * kSteps * 2; k += kThreads) {
      const int row = k / (kSteps * 2), part = k % (kSteps * 2);
      const std::uint32_t r =
          min((row_tile * kRows + static_cast<std::uint32_t>(row)) * batch.step, f.row_count - 1);
      __pipeline_memcpy_async(&tile[buffer][row * kStride + part * 4],
                              f.row_half + static_cast<std::size_t>(r) * (kSteps * 16) + part * 8,
                              16);
    }
    if (threadIdx.x < kRows) {
      const std::uint32_t r = (row_tile * kRows + threadIdx.x) * batch.step;
      if (r < f.row_count)
        __pipeline_memcpy_async(&square[buffer][threadIdx.x],
                                kCollect ? &f.row_square[r].x : &f.row_square[r].y, sizeof(float));
      else
        square[buffer][threadIdx.x] = kInfinity;
    }
    __pipeline_commit();
  };
  fetch(first_tile, 0);

  // Tiles of 16 queries, times -2; this lane holds parts of queries row_of_lane and row_of_lane + 8
  // of each.
  std::uint32_t a[kTiles][kSteps][4];
  float limit[2 * kTiles];
  // Squares of rows in the unit of the products.
  const float unit = *f.query_scale / *f.row_scale;
#pragma unroll
  for (int m = 0; m < 2 * kTiles; ++m) {
    const std::uint32_t q = q_first + static_cast<std::uint32_t>(m * 8 + row_of_lane);
    const std::uint32_t own = q < f.query_count ? f.row_of(q) : 0;
    const bool asks = q < f.query_count && f.query_valid[own];
    limit[m] = kCollect ? -kInfinity : kInfinity;
    if (kCollect && asks)
      limit[m] = from_ordered(batch.bound[f.out + q]) + 2.0f * f.query_error[own] / unit +
                 kTinySquare * (*f.query_scale * *f.row_scale);
    const std::uint32_t* query = reinterpret_cast<const std::uint32_t*>(f.query_half) +
                                 static_cast<std::size_t>(own) * kWords + k_of_lane;
#pragma unroll
    for (int s = 0; s < kSteps; ++s)
#pragma unroll
      for (int half = 0; half < 2; ++half) {
        std::uint32_t two = asks ? query[s * 8 + half * 4] : 0u;
        if (kCopy == HalfCopy::turned && s * 8 + half * 4 + k_of_lane == (kAxisPlace + 1) / 2)
          two = two << 16 | two >> 16;
        const __half2 doubled =
            __hmul2(*reinterpret_cast<const __half2*>(&two), __floats2half2_rn(-2.0f, -2.0f));
        a[m / 2][s][m % 2 + 2 * half] = *reinterpret_cast<const std::uint32_t*>(&doubled);
      }
  }

  int buffer = 0;
  for (std::uint32_t row_tile = first_tile; row_tile < end_tile; ++row_tile, buffer ^= 1) {
    if (row_tile + 1 < end_tile)
      fetch(row_tile + 1, buffer ^ 1);
    else
      __pipeline_commit();
    __pipeline_wait_prior(1);
    __syncthreads();
#pragma unroll 2
    for (int n0 = 0; n0 < kRows; n0 += 8) {
      std::uint32_t b[2 * kSteps];
      load_rows<kSteps>(b, tile[buffer] + n0 * kStride, kStride, lane);
      // Of each product this lane has the columns 2 k_of_lane and 2 k_of_lane + 1. Rows outside the
      // search have infinite squares, which fail every comparison.
      const float2 two = *reinterpret_cast<const float2*>(&square[buffer][n0 + 2 * k_of_lane]);
      const float start[4] = {two.x * unit, two.y * unit, two.x * unit, two.y * unit};
      float c[kTiles][4];
#pragma unroll
      for (int t = 0; t < kTiles; ++t) multiply_add(c[t], a[t][0], b, start);
#pragma unroll
      for (int s = 1; s < kSteps; ++s)
#pragma unroll
        for (int t = 0; t < kTiles; ++t) multiply_add(c[t], a[t][s], b + 2 * s, c[t]);
      if (!kCollect) {
#pragma unroll
        for (int m = 0; m < 2 * kTiles; ++m)
          limit[m] = fminf(limit[m], fminf(c[m / 2][m % 2 * 2], c[m / 2][m % 2 * 2 + 1]));
        continue;
      }
      bool any = false;
#pragma unroll
      for (int m = 0; m < 2 * kTiles; ++m)
        any = any | (fminf(c[m / 2][m % 2 * 2], c[m / 2][m % 2 * 2 + 1]) <= limit[m]);
      const unsigned lanes = __ballot_sync(~0u, any);
      if (lanes != 0) {
        if (any) {
          std::uint32_t which = 0;
#pragma unroll
          for (int m = 0; m < 2 * kTiles; ++m)
#pragma unroll
            for (int j = 0; j < 2; ++j)
              which |= c[m / 2][m % 2 * 2 + j] <= limit[m] ? 1u << (2 * m + j) : 0u;
          const auto at = queued + static_cast<std::uint32_t>(
                                       __popc(static_cast<int>(lanes & ((1u << lane) - 1))));
          queue[warp][at] = {which, static_cast<std::uint32_t>(lane),
                             row_tile * kRows + static_cast<std::uint32_t>(n0)};
        }
        queued += static_cast<std::uint32_t>(__popc(static_cast<int>(lanes)));
        if (queued >= kFull) {
          __syncwarp();
          queued -= kFull;
          measure_found<kWidth>(f, q_first, queue[warp][queued + static_cast<std::uint32_t>(lane)],
                                batch.best);
          __syncwarp();
        }
      }
    }
    __syncthreads();
  }
  if (kCollect && static_cast<std::uint32_t>(lane) < queued)
    measure_found<kWidth>(f, q_first, queue[warp][lane], batch.best);
  if constexpr (!kCollect) {
#pragma unroll
    for (int m = 0; m < 2 * kTiles; ++m) {
      limit[m] = fminf(limit[m], __shfl_xor_sync(~0u, limit[m], 1));
      limit[m] = fminf(limit[m], __shfl_xor_sync(~0u, limit[m], 2));
      const std::uint32_t q = q_first + static_cast<std::uint32_t>(m * 8 + row_of_lane);
      if (k_of_lane == 0 && q < f.query_count)
        atomicMin(batch.bound + f.out + q, ordered(limit[m]));
    }
  }
}

/// Splits rows into parts so that the last wave of thread blocks wastes little, and no part is so
/// small that reading the queries dominates.
std::uint32_t tiles_of_part(const Exec& exec, int blocks, std::size_t query_blocks,
                            std::uint32_t rows) {
  constexpr std::size_t kWaves = 8, kLeast = 6;
  const std::size_t tiles = blocks_for(rows, kRows),
                    wanted = kWaves * static_cast<std::size_t>(blocks * exec.multiprocessors());
  const std::size_t parts = std::max<std::size_t>(
      1, std::min(tiles / kLeast, (wanted + query_blocks - 1) / query_blocks));
  return static_cast<std::uint32_t>((tiles + parts - 1) / parts);
}

template <int kSteps, int kWidth, HalfCopy kCopy>
void run(Exec& exec, unsigned entries, std::uint32_t most_queries, std::uint32_t most_rows,
         FilterBatch batch) {
  const unsigned query_blocks = blocks_for(most_queries, kQueries);
  const auto grid = [&](std::uint32_t step) {
    batch.step = step;
    const std::uint32_t rows = blocks_for(most_rows, step);
    batch.tiles_per_part = tiles_of_part(exec, blocks_a_multiprocessor(kSteps),
                                         std::size_t(query_blocks) * entries, rows);
    return dim3(query_blocks, blocks_for(blocks_for(rows, kRows), batch.tiles_per_part), entries);
  };
  const dim3 some = grid(kStep);
  launch(exec, "filter, bounds", filter<kSteps, kWidth, kCopy, false>, {some, kThreads}, batch);
  const dim3 all = grid(1);
  launch(exec, "filter, candidates", filter<kSteps, kWidth, kCopy, true>, {all, kThreads}, batch);
}

}  // namespace

bool has_filter(const Exec& exec) {
  return exec.compiled_for(filter<1, 16, HalfCopy::plain, false>) >= kTensorArchitecture;
}

void filter_nearest(Exec& exec, const FeatureQuery* batch, unsigned entries,
                    std::uint32_t most_queries, std::uint32_t most_rows, std::uint32_t dimensions,
                    HalfCopy copy, std::size_t answers, unsigned long long* best) {
  // Bytes of 0x7f are an integer above every ordered float.
  const auto bound = exec.filled<std::int32_t>(answers, 0x7f);
  const FilterBatch filter_batch{batch, 0, 1, bound.data(), best};
  if (copy == HalfCopy::turned)
    return run<kTurnedWidth / 16, 36, HalfCopy::turned>(exec, entries, most_queries, most_rows,
                                                        filter_batch);
  switch (padded_width(dimensions)) {
    case 16:
      return run<1, 16, HalfCopy::plain>(exec, entries, most_queries, most_rows, filter_batch);
    case 32:
      return run<2, 32, HalfCopy::plain>(exec, entries, most_queries, most_rows, filter_batch);
    case 36:
      return run<3, 36, HalfCopy::plain>(exec, entries, most_queries, most_rows, filter_batch);
    case 48:
      return run<3, 48, HalfCopy::plain>(exec, entries, most_queries, most_rows, filter_batch);
    default:
      return run<4, 64, HalfCopy::plain>(exec, entries, most_queries, most_rows, filter_batch);
  }
}

}  // namespace gpureg::cuda
