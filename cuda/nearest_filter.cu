// SPDX-License-Identifier: BSD-3-Clause
#include <cuda_pipeline.h>

#include <algorithm>

#include "nearest_feature.hpp"

// Exact nearest features at the speed of the tensor cores. |q - r|^2 = |q|^2 + |r|^2 - 2 q.r, and the product of two vectors rounded to
// tf32 is off by less than 2^-10 |q| |r|: so for each query an upper bound of its nearest distance comes out of a first pass over all
// rows, and a second pass lists the rows whose lower bound is not above it (16 of 5,000 for FPFH). Those are measured by the very chain of
// fmaf that defines the distance, so the answer has the bits of an exhaustive search.
namespace gpureg::cuda {
namespace {

constexpr int kWarps = 8;
constexpr int kThreads = 32 * kWarps;
constexpr int kQueriesPerWarp = 32;
constexpr int kQueries = kWarps * kQueriesPerWarp;
constexpr int kRows = 64;            // of a tile in shared memory
constexpr int kQueue = 32 + 8 * 32;  // what waits plus what one step can add
/// Of |q| |r|: twice the rounding of the product, and room for the sums.
constexpr float kProductError = 2.0f / 1024.0f * 1.02f;
/// Of |r|^2 and |q|^2: rounding of norms and of the distance itself.
constexpr float kNormError = 1e-5f;

struct FilterBatch {
  const FeatureQuery* queries;
  std::uint32_t rows_per_part;
  std::int32_t* bound;          // per answer: smallest upper bound of |r|^2 - 2 q.r, as an ordered integer
  unsigned long long* best;
};

__device__ std::int32_t ordered(float v) {
  const std::int32_t bits = __float_as_int(v);
  return bits ^ ((bits >> 31) & 0x7fffffff);
}
__device__ float from_ordered(std::int32_t v) { return __int_as_float(v ^ ((v >> 31) & 0x7fffffff)); }

#if !defined(__CUDA_ARCH__) || __CUDA_ARCH__ >= 800
__device__ void multiply_add(float (&c)[4], const std::uint32_t (&a)[4], std::uint32_t b0, std::uint32_t b1) {
  asm("mma.sync.aligned.m16n8k8.row.col.f32.tf32.tf32.f32 {%0,%1,%2,%3}, {%4,%5,%6,%7}, {%8,%9}, {%0,%1,%2,%3};"
      : "+f"(c[0]), "+f"(c[1]), "+f"(c[2]), "+f"(c[3])
      : "r"(a[0]), "r"(a[1]), "r"(a[2]), "r"(a[3]), "r"(b0), "r"(b1));
}
#else
// Never launched there.
__device__ void multiply_add(float (&)[4], const std::uint32_t (&)[4], std::uint32_t, std::uint32_t) {}
#endif

/// The distance that everything is about. The zeros at the end of a row change nothing.
template <int kWidth>
__device__ void measure(const FeatureQuery& f, std::uint32_t q, std::uint32_t r, unsigned long long* best) {
  const float4* query = reinterpret_cast<const float4*>(f.query_padded + static_cast<std::size_t>(q) * kWidth);
  const float4* row = reinterpret_cast<const float4*>(f.row_padded + static_cast<std::size_t>(r) * kWidth);
  float sum = 0.0f;
  const auto add = [&](float a, float b) {
    const float difference = a - b;
    sum = fmaf(difference, difference, sum);
  };
#pragma unroll
  for (int k = 0; k < kWidth / 4; ++k) {
    const float4 a = __ldg(query + k), b = __ldg(row + k);
    add(a.x, b.x), add(a.y, b.y), add(a.z, b.z), add(a.w, b.w);
  }
  if (!(sum < __uint_as_float(0x7f800000u))) return;
  const unsigned long long found = static_cast<unsigned long long>(__float_as_uint(sum)) << 32 | r;
  if (found < best[f.out + q]) atomicMin(best + f.out + q, found);
}

/// kSteps: dimensions over 8. First pass (kCollect false): bounds; second: the rows within them. Blocks: x queries, y part of the rows, z
/// entry.
template <int kSteps, bool kCollect>
__global__ void __launch_bounds__(kThreads, 2) filter(FilterBatch batch) {
  constexpr int kWidth = kSteps * 8, kStride = kWidth + 4;  // lanes of a fragment read 32 different banks
  constexpr float kInfinity = 3.402823466e38f * 2.0f;
  __shared__ __align__(16) std::uint32_t tile[2][kRows * kStride];
  __shared__ __align__(16) float2 norm[2][kRows];
  __shared__ std::uint32_t queue[kCollect ? kWarps : 1][kQueue];
  __shared__ std::uint32_t queued[kWarps];
  const FeatureQuery f = batch.queries[blockIdx.z];
  const std::uint32_t r_first = blockIdx.y * batch.rows_per_part, r_last = min(f.row_count, r_first + batch.rows_per_part);
  if (blockIdx.x * kQueries >= f.query_count || r_first >= f.row_count) return;
  const int warp = static_cast<int>(threadIdx.x / 32), lane = static_cast<int>(threadIdx.x % 32), row_of_lane = lane / 4, k_of_lane = lane % 4;
  const std::uint32_t q_first = blockIdx.x * kQueries + static_cast<std::uint32_t>(warp * kQueriesPerWarp);
  if (lane == 0) queued[warp] = 0;

  const auto fetch = [&](std::uint32_t base, int buffer) {
    for (int k = static_cast<int>(threadIdx.x); k < kRows * kSteps * 2; k += kThreads) {
      const int row = k / (kSteps * 2), part = k % (kSteps * 2) * 4;
      const std::uint32_t r = min(base + static_cast<std::uint32_t>(row), f.row_count - 1);
      __pipeline_memcpy_async(&tile[buffer][row * kStride + part], f.row_tf32 + static_cast<std::size_t>(r) * kWidth + part, 16);
    }
    if (threadIdx.x < kRows) {
      const std::uint32_t r = base + threadIdx.x;
      if (r < r_last)
        __pipeline_memcpy_async(&norm[buffer][threadIdx.x], f.row_norm + r, sizeof(float2));
      else
        norm[buffer][threadIdx.x] = make_float2(kInfinity, kInfinity);
    }
    __pipeline_commit();
  };
  fetch(r_first, 0);

  // Two tiles of 16 queries; this lane holds parts of queries row_of_lane and row_of_lane + 8 of each.
  std::uint32_t a[2][kSteps][4];
  float length[4], limit[4];
#pragma unroll
  for (int m = 0; m < 4; ++m) {
    const std::uint32_t q = q_first + static_cast<std::uint32_t>(m * 8 + row_of_lane);
    const bool asks = q < f.query_count && f.query_valid[q];
    const float2 n = asks ? f.query_norm[q] : make_float2(0, 0);
    length[m] = n.y * kProductError;
    limit[m] = kCollect ? -kInfinity : kInfinity;
    if (kCollect && asks) limit[m] = from_ordered(batch.bound[f.out + q]) + 2.0f * kNormError * n.x + 1e-30f;
#pragma unroll
    for (int s = 0; s < kSteps; ++s)
#pragma unroll
      for (int half = 0; half < 2; ++half)
        a[m / 2][s][m % 2 + 2 * half] = asks ? f.query_tf32[static_cast<std::size_t>(q) * kWidth + s * 8 + half * 4 + k_of_lane] : 0u;
  }

  int buffer = 0;
  for (std::uint32_t base = r_first; base < r_last; base += kRows, buffer ^= 1) {
    if (base + kRows < r_last)
      fetch(base + kRows, buffer ^ 1);
    else
      __pipeline_commit();
    __pipeline_wait_prior(1);
    __syncthreads();
#pragma unroll 2
    for (int n0 = 0; n0 < kRows; n0 += 8) {
      float c[2][4] = {{0, 0, 0, 0}, {0, 0, 0, 0}};
      const std::uint32_t* fragment = tile[buffer] + (n0 + row_of_lane) * kStride + k_of_lane;
#pragma unroll
      for (int s = 0; s < kSteps; ++s) {
        const std::uint32_t b0 = fragment[s * 8], b1 = fragment[s * 8 + 4];
        multiply_add(c[0], a[0][s], b0, b1);
        multiply_add(c[1], a[1][s], b0, b1);
      }
      // Of each result this lane has the columns 2 k_of_lane and 2 k_of_lane + 1. Rows that are not valid have infinite norms: their bounds
      // are infinite or NaN, which no comparison lets through.
      const float4 n = *reinterpret_cast<const float4*>(&norm[buffer][n0 + 2 * k_of_lane]);
      // Squares a little longer in the first pass, a little shorter in the second: bounds.
      const float squared[2] = {n.x * (kCollect ? 1.0f - kNormError : 1.0f + kNormError), n.z * (kCollect ? 1.0f - kNormError : 1.0f + kNormError)};
      const float row_length[2] = {n.y, n.w};
      bool any = false;
      float lower[4][2];
#pragma unroll
      for (int m = 0; m < 4; ++m)
#pragma unroll
        for (int j = 0; j < 2; ++j) {
          const float middle = fmaf(-2.0f, c[m / 2][m % 2 * 2 + j], squared[j]);
          if (!kCollect) {
            limit[m] = fminf(limit[m], fmaf(length[m], row_length[j], middle));
          } else {
            lower[m][j] = fmaf(-length[m], row_length[j], middle);
            any = any || lower[m][j] <= limit[m];
          }
        }
      if (!kCollect) continue;
      if (any) {
#pragma unroll
        for (int m = 0; m < 4; ++m)
#pragma unroll
          for (int j = 0; j < 2; ++j)
            if (lower[m][j] <= limit[m])
              queue[warp][atomicAdd(&queued[warp], 1u)] =
                  static_cast<std::uint32_t>(m * 8 + row_of_lane) << 27 | (base - r_first + static_cast<std::uint32_t>(n0 + 2 * k_of_lane + j));
      }
      const bool last = n0 + 8 == kRows && base + kRows >= r_last;
      if (!last && !__any_sync(~0u, any)) continue;
      __syncwarp();
      const std::uint32_t waiting = queued[warp];
      if (waiting >= 32 || last) {
        for (std::uint32_t k = static_cast<std::uint32_t>(lane); k < waiting; k += 32) {
          const std::uint32_t entry = queue[warp][k];
          measure<kWidth>(f, q_first + (entry >> 27), r_first + (entry & 0x7ffffffu), batch.best);
        }
        __syncwarp();
        if (lane == 0) queued[warp] = 0;
      }
      __syncwarp();
    }
    __syncthreads();
  }
  if constexpr (!kCollect) {
#pragma unroll
    for (int m = 0; m < 4; ++m) {
      limit[m] = fminf(limit[m], __shfl_xor_sync(~0u, limit[m], 1));
      limit[m] = fminf(limit[m], __shfl_xor_sync(~0u, limit[m], 2));
      const std::uint32_t q = q_first + static_cast<std::uint32_t>(m * 8 + row_of_lane);
      if (k_of_lane == 0 && q < f.query_count) atomicMin(batch.bound + f.out + q, ordered(limit[m]));
    }
  }
}

template <int kSteps>
void run(Exec& exec, dim3 grid, const FilterBatch& batch) {
  filter<kSteps, false><<<grid, kThreads, 0, exec.stream()>>>(batch);
  check_launch("filter, bounds");
  filter<kSteps, true><<<grid, kThreads, 0, exec.stream()>>>(batch);
  check_launch("filter, candidates");
}

}  // namespace

void filter_nearest(Exec& exec, const FeatureQuery* batch, unsigned entries, std::uint32_t most_queries, std::uint32_t most_rows,
                    std::uint32_t dimensions, std::size_t answers, unsigned long long* best) {
  // Bytes of 0x7f are an integer above every ordered float.
  const auto bound = exec.filled<std::int32_t>(answers, 0x7f);
  const unsigned query_blocks = blocks_for(most_queries, kQueries);
  const std::uint32_t rows_per_part = std::min(rows_of_part(exec, std::size_t(query_blocks) * entries, most_rows, kRows), 1u << 26);
  const dim3 grid(query_blocks, blocks_for(most_rows, rows_per_part), entries);
  const FilterBatch filter_batch{batch, rows_per_part, bound.data(), best};
  switch (filter_width(dimensions)) {
    case 16: return run<2>(exec, grid, filter_batch);
    case 40: return run<5>(exec, grid, filter_batch);
    default: return run<8>(exec, grid, filter_batch);
  }
}

}  // namespace gpureg::cuda
