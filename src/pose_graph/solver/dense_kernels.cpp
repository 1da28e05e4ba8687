// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/solver/dense_kernels.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "common/for_each_on.hpp"

#if defined(__GNUC__) && defined(__x86_64__)
#define GPUREG_AVX2_KERNELS 1
#endif

namespace gpureg::pose_graph {
namespace {

/// Columns that are factorised before the rest is updated: a panel of them stays in the first-level
/// cache while a tile is updated.
constexpr int kPanel = 48;
constexpr int kTileRows = 12, kTileColumns = 4;

/// Four doubles; the compiler splits them where the processor has shorter registers.
typedef double Vec4 __attribute__((vector_size(32), aligned(8), may_alias));

/// C -= A B' for one tile of 12 x 4: a, b have leading dimension ld and `depth` columns.
__attribute__((always_inline)) inline void update_tile(double* c, const double* a, const double* b,
                                                       std::size_t ld, int depth) {
  Vec4 sum[kTileColumns][3] = {};
  for (int p = 0; p < depth; ++p) {
    const Vec4* rows = reinterpret_cast<const Vec4*>(a + p * ld);
    const double* factor = b + p * ld;
    const Vec4 r0 = rows[0], r1 = rows[1], r2 = rows[2];
    for (int j = 0; j < kTileColumns; ++j) {
      const Vec4 f = {factor[j], factor[j], factor[j], factor[j]};
      sum[j][0] += r0 * f;
      sum[j][1] += r1 * f;
      sum[j][2] += r2 * f;
    }
  }
  for (int j = 0; j < kTileColumns; ++j) {
    Vec4* column = reinterpret_cast<Vec4*>(c + j * ld);
    for (int k = 0; k < 3; ++k) column[k] -= sum[j][k];
  }
}

/// The same for tiles at the border; each element's sum has the same order.
__attribute__((always_inline)) inline void update_border(double* c, const double* a,
                                                         const double* b, std::size_t ld, int depth,
                                                         int rows, int columns) {
  for (int j = 0; j < columns; ++j)
    for (int i = 0; i < rows; ++i) {
      double sum = 0;
      for (int p = 0; p < depth; ++p) sum += a[i + p * ld] * b[j + p * ld];
      c[i + j * ld] -= sum;
    }
}

__attribute__((always_inline)) inline bool factorise_panel(double* m, std::size_t ld, int size,
                                                           int begin, int end) {
  for (int k = begin; k < end; ++k) {
    double* column = m + k * ld;
    const double pivot = column[k];
    if (!(pivot > 0) || !std::isfinite(pivot)) return false;
    const double root = std::sqrt(pivot), inverse = 1 / root;
    column[k] = root;
    for (int i = k + 1; i < size; ++i) column[i] *= inverse;
    for (int j = k + 1; j < end; ++j) {
      double* other = m + j * ld;
      const double factor = column[j];
      for (int i = j; i < size; ++i) other[i] -= column[i] * factor;
    }
  }
  return true;
}

/// Columns [j, last) of what is left, by a panel of columns [begin, end).
__attribute__((always_inline)) inline void update_columns(double* m, std::size_t ld, int size,
                                                          int begin, int end, int j, int last) {
  const int depth = end - begin;
  const double* panel = m + begin * ld;
  for (; j < last; j += kTileColumns) {
    const int tile_columns = std::min(kTileColumns, size - j);
    int i = j;
    if (tile_columns == kTileColumns)
      for (; i + kTileRows <= size; i += kTileRows)
        update_tile(m + i + j * ld, panel + i, panel + j, ld, depth);
    if (i < size)
      update_border(m + i + j * ld, panel + i, panel + j, ld, depth, size - i, tile_columns);
  }
}

/// One processor's version of both.
struct Kernels {
  bool (*factorise)(double* m, std::size_t ld, int size, int begin, int end);
  void (*update)(double* m, std::size_t ld, int size, int begin, int end, int j, int last);
};

constexpr Kernels kPlain = {[](double* m, std::size_t ld, int size, int begin, int end) {
                              return factorise_panel(m, ld, size, begin, end);
                            },
                            [](double* m, std::size_t ld, int size, int begin, int end, int j,
                               int last) { update_columns(m, ld, size, begin, end, j, last); }};

#ifdef GPUREG_AVX2_KERNELS
__attribute__((target("avx2"))) bool factorise_avx2(double* m, std::size_t ld, int size, int begin,
                                                    int end) {
  return factorise_panel(m, ld, size, begin, end);
}
__attribute__((target("avx2"))) void update_avx2(double* m, std::size_t ld, int size, int begin,
                                                 int end, int j, int last) {
  update_columns(m, ld, size, begin, end, j, last);
}
#endif

const Kernels& kernels() {
#ifdef GPUREG_AVX2_KERNELS
  static constexpr Kernels kAvx2 = {factorise_avx2, update_avx2};
  static const bool avx2 = __builtin_cpu_supports("avx2");
  if (avx2) return kAvx2;
#endif
  return kPlain;
}

/// Multiplications of a thread that take longer than its start, and columns that it takes at once.
constexpr double kOfThread = 2e6;
constexpr int kStrip = 16 * kTileColumns;

}  // namespace

bool partial_cholesky(double* matrix, int size, int columns, int threads) {
  const Kernels& run = kernels();
  const std::size_t ld = static_cast<std::size_t>(size);
  for (int begin = 0; begin < columns; begin += kPanel) {
    const int end = std::min(begin + kPanel, columns);
    if (!run.factorise(matrix, ld, size, begin, end)) return false;
    const double rest = size - end, work = 0.5 * rest * rest * (end - begin);
    const int used = static_cast<int>(std::min<double>(threads, work / kOfThread));
    if (used < 2) {
      run.update(matrix, ld, size, begin, end, end, size);
      continue;
    }
    const auto strips = static_cast<std::size_t>((size - end + kStrip - 1) / kStrip);
    for_each_on(static_cast<std::size_t>(used), strips, [&](std::size_t strip) {
      const int first = end + static_cast<int>(strip) * kStrip;
      run.update(matrix, ld, size, begin, end, first, std::min(first + kStrip, size));
    });
  }
  return true;
}

}  // namespace gpureg::pose_graph
