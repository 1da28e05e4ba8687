// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/common/cell_summary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/radix_sort.hpp"

#if defined(__AVX2__) && defined(__FMA__)
#include <immintrin.h>
#endif

namespace gpureg::cpu {
namespace {

constexpr int kEdge = ClosestGridView::kBlockEdge;
constexpr int kCells = ClosestGridView::kBlockCells;
/// Steps of the golden section spread groups evenly, however many are read.
constexpr double kGoldenSection = 0.6180339887;
/// The low 21 bits of each coordinate, interleaved.
std::uint64_t morton_key(Cell c) {
  const auto spread = [](std::int32_t v) {
    std::uint64_t x = static_cast<std::uint32_t>(v + kCellBias) & 0x1fffffu;
    x = (x | x << 32) & 0x1f00000000ffffull;
    x = (x | x << 16) & 0x1f0000ff0000ffull;
    x = (x | x << 8) & 0x100f00f00f00f00full;
    x = (x | x << 4) & 0x10c30c30c30c30c3ull;
    return (x | x << 2) & 0x1249249249249249ull;
  };
  return spread(c.x) | spread(c.y) << 1 | spread(c.z) << 2;
}

}  // namespace

ScoringOrder scoring_order(const std::vector<Vec3>& points, const std::vector<Vec3>& normals,
                           float cell_size) {
  ScoringOrder out;
  const std::size_t n = points.size();
  const std::size_t groups = (n + 63) / 64;
  // Neighbours in space (Morton order) share a group of 64, so the cells of a group share cache
  // lines. The groups themselves follow in steps of the golden section, so the first few represent
  // the whole cloud.
  std::vector<KeyIndex> morton(n);
  for (std::size_t i = 0; i < n; ++i)
    morton[i] = {morton_key(cell_of(points[i], 1.0f / cell_size)), static_cast<std::uint32_t>(i)};
  radix_sort(morton);
  std::size_t step = static_cast<std::size_t>(kGoldenSection * static_cast<double>(groups)) | 1;
  while (groups > 0 && std::gcd(step, groups) != 1) ++step;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (auto* v : {&out.x, &out.y, &out.z}) v->assign(groups * 64, nan);
  for (auto* v : {&out.nx, &out.ny, &out.nz}) v->assign(groups * 64, 0.0f);
  out.index.assign(groups * 64, kNoValue);
  for (std::size_t g = 0, from = 0; g < groups; ++g, from = (from + step) % groups) {
    for (std::size_t l = 0; l < 64 && from * 64 + l < n; ++l) {
      const std::size_t k = g * 64 + l;
      const std::uint32_t i = morton[from * 64 + l].index;
      out.index[k] = i;
      out.x[k] = points[i].x;
      out.y[k] = points[i].y;
      out.z[k] = points[i].z;
      out.nx[k] = normals[i].x;
      out.ny[k] = normals[i].y;
      out.nz[k] = normals[i].z;
    }
    out.remaining.push_back(0);
  }
  std::uint32_t after = 0;
  for (std::size_t g = groups; g-- > 0;) {
    out.remaining[g] = after;
    for (std::size_t l = 0; l < 64; ++l) after += out.index[g * 64 + l] != kNoValue;
  }
  return out;
}

CellSummaries summarize_cells(const ClosestGrid& closest, float search_distance, float cloud_radius,
                              const std::vector<Vec3>& points, const std::vector<Vec3>& normals) {
  CellSummaries out;
  if (closest.blocks.empty()) return out;
  Cell lo = closest.blocks[0], hi = lo;
  for (const Cell& c : closest.blocks) {
    lo = {std::min(lo.x, c.x), std::min(lo.y, c.y), std::min(lo.z, c.z)};
    hi = {std::max(hi.x, c.x), std::max(hi.y, c.y), std::max(hi.z, c.z)};
  }
  const double nx = hi.x - lo.x + 1.0, ny = hi.y - lo.y + 1.0, nz = hi.z - lo.z + 1.0;
  if (nx * ny * nz > static_cast<double>(limits::kMaxSummaryBlocks)) return out;
  const ClosestGeometry g = closest_geometry(search_distance, cloud_radius);
  out.inverse_cell_size = 1.0f / closest.cell_size;
  out.offset = {-static_cast<float>(lo.x * kEdge), -static_cast<float>(lo.y * kEdge),
                -static_cast<float>(lo.z * kEdge)};
  out.nx = static_cast<std::int32_t>(nx);
  out.ny = static_cast<std::int32_t>(ny);
  out.nz = static_cast<std::int32_t>(nz);
  // Block 0 is empty: locations without a block read zeros from it instead of branching.
  out.block.assign(static_cast<std::size_t>(nx * ny * nz), 0);
  out.summary.assign((closest.blocks.size() + 1) * kCells, 0);
  for (std::size_t b = 0; b < closest.blocks.size(); ++b) {
    const Cell block = closest.blocks[b];
    out.block[(static_cast<std::size_t>(block.z - lo.z) * out.ny + (block.y - lo.y)) * out.nx +
              (block.x - lo.x)] = static_cast<std::int32_t>(b + 1);
    const std::uint32_t* start = closest.cell_start.data() + b * (kCells + 1);
    for (int cell = 0; cell < kCells; ++cell) {
      if (start[cell] == start[cell + 1]) continue;
      const Cell c{block.x * kEdge + (cell & 7), block.y * kEdge + ((cell >> 3) & 7),
                   block.z * kEdge + (cell >> 6)};
      out.summary[(b + 1) * kCells + cell] =
          summarize_cell({closest.candidates.data() + start[cell], start[cell + 1] - start[cell]},
                         cell_center(c, closest.cell_size), g, points.data(), normals.data());
    }
  }
  return out;
}

#if defined(__AVX2__) && defined(__FMA__)

void locate_cells(const ScoringOrder& order, std::size_t first, const Rigid& pose,
                  const CellSummaries& v, std::int32_t* cells) {
  // The pose in cells of the table. Its rounding differs from that of apply() by a small part of a
  // cell, which the margin of the closest-point grid covers.
  const float s = v.inverse_cell_size;
  __m256 r[9], t[3];
  const float offset[3] = {v.offset.x, v.offset.y, v.offset.z};
  for (int k = 0; k < 9; ++k) r[k] = _mm256_set1_ps(pose.r[k] * s);
  for (int k = 0; k < 3; ++k) t[k] = _mm256_set1_ps(pose.t[k] * s + offset[k]);
  const __m256i nx = _mm256_set1_epi32(v.nx), ny = _mm256_set1_epi32(v.ny),
                nz = _mm256_set1_epi32(v.nz);
  const __m256i minus_one = _mm256_set1_epi32(-1), seven = _mm256_set1_epi32(7);
  for (int k = 0; k < 64; k += 8) {
    const __m256 x = _mm256_loadu_ps(order.x.data() + first + k),
                 y = _mm256_loadu_ps(order.y.data() + first + k),
                 z = _mm256_loadu_ps(order.z.data() + first + k);
    const __m256 fx =
        _mm256_fmadd_ps(r[2], z, _mm256_fmadd_ps(r[1], y, _mm256_fmadd_ps(r[0], x, t[0])));
    const __m256 fy =
        _mm256_fmadd_ps(r[5], z, _mm256_fmadd_ps(r[4], y, _mm256_fmadd_ps(r[3], x, t[1])));
    const __m256 fz =
        _mm256_fmadd_ps(r[8], z, _mm256_fmadd_ps(r[7], y, _mm256_fmadd_ps(r[6], x, t[2])));
    // NaN (padding) and overflow become INT_MIN, which is outside.
    const __m256i ix = _mm256_cvttps_epi32(_mm256_floor_ps(fx)),
                  iy = _mm256_cvttps_epi32(_mm256_floor_ps(fy)),
                  iz = _mm256_cvttps_epi32(_mm256_floor_ps(fz));
    const __m256i bx = _mm256_srai_epi32(ix, 3), by = _mm256_srai_epi32(iy, 3),
                  bz = _mm256_srai_epi32(iz, 3);
    __m256i inside =
        _mm256_and_si256(_mm256_cmpgt_epi32(bx, minus_one), _mm256_cmpgt_epi32(nx, bx));
    inside = _mm256_and_si256(
        inside, _mm256_and_si256(_mm256_cmpgt_epi32(by, minus_one), _mm256_cmpgt_epi32(ny, by)));
    inside = _mm256_and_si256(
        inside, _mm256_and_si256(_mm256_cmpgt_epi32(bz, minus_one), _mm256_cmpgt_epi32(nz, bz)));
    const __m256i at = _mm256_add_epi32(
        _mm256_mullo_epi32(_mm256_add_epi32(_mm256_mullo_epi32(bz, ny), by), nx), bx);
    const __m256i block =
        _mm256_mask_i32gather_epi32(_mm256_setzero_si256(), v.block.data(), at, inside, 4);
    const __m256i cell =
        _mm256_or_si256(_mm256_or_si256(_mm256_slli_epi32(block, 9),
                                        _mm256_slli_epi32(_mm256_and_si256(iz, seven), 6)),
                        _mm256_or_si256(_mm256_slli_epi32(_mm256_and_si256(iy, seven), 3),
                                        _mm256_and_si256(ix, seven)));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(cells + k), cell);
  }
  // Reads the summaries of this group after the cells of the next group are known, so that the
  // prefetch has time.
  for (int k = 0; k < 64; ++k)
    _mm_prefetch(reinterpret_cast<const char*>(v.summary.data() + cells[k]), _MM_HINT_T0);
}

PointBounds bound_inliers(const ScoringOrder& order, std::size_t first, const Rigid& pose,
                          const CellSummaries& v, const SummaryLimits& limits,
                          const std::int32_t* cells) {
  PointBounds out{0, 0};
  __m256 r[9];
  for (int k = 0; k < 9; ++k) r[k] = _mm256_set1_ps(pose.r[k] * (1.0f / 127.0f));
  for (int k = 0; k < 64; k += 8) {
    const __m256i cell = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(cells + k));
    const __m256i word =
        _mm256_i32gather_epi32(reinterpret_cast<const int*>(v.summary.data()), cell, 4);
    const __m256 mx = _mm256_cvtepi32_ps(_mm256_srai_epi32(_mm256_slli_epi32(word, 24), 24)),
                 my = _mm256_cvtepi32_ps(_mm256_srai_epi32(_mm256_slli_epi32(word, 16), 24)),
                 mz = _mm256_cvtepi32_ps(_mm256_srai_epi32(_mm256_slli_epi32(word, 8), 24));
    // n' R' m: rotates the mean normal back instead of every source normal forth.
    const __m256 sx = _mm256_fmadd_ps(r[6], mz, _mm256_fmadd_ps(r[3], my, _mm256_mul_ps(r[0], mx)));
    const __m256 sy = _mm256_fmadd_ps(r[7], mz, _mm256_fmadd_ps(r[4], my, _mm256_mul_ps(r[1], mx)));
    const __m256 sz = _mm256_fmadd_ps(r[8], mz, _mm256_fmadd_ps(r[5], my, _mm256_mul_ps(r[2], mx)));
    const __m256 cosine = _mm256_fmadd_ps(
        _mm256_loadu_ps(order.nz.data() + first + k), sz,
        _mm256_fmadd_ps(_mm256_loadu_ps(order.ny.data() + first + k), sy,
                        _mm256_mul_ps(_mm256_loadu_ps(order.nx.data() + first + k), sx)));
    const __m256i code = _mm256_srli_epi32(word, 24);
    const __m256 below = _mm256_i32gather_ps(limits.none_below, code, 4),
                 above = _mm256_i32gather_ps(limits.all_above, code, 4);
    const unsigned possible =
        static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(cosine, below, _CMP_GE_OQ)));
    const unsigned certain =
        static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(cosine, above, _CMP_GE_OQ)));
    out.possible |= static_cast<std::uint64_t>(possible) << k;
    out.certain |= static_cast<std::uint64_t>(certain) << k;
  }
  return out;
}

#else

void locate_cells(const ScoringOrder& order, std::size_t first, const Rigid& pose,
                  const CellSummaries& v, std::int32_t* cells) {
  for (int k = 0; k < 64; ++k) {
    const std::size_t i = first + static_cast<std::size_t>(k);
    const Vec3 q = apply(pose, {order.x[i], order.y[i], order.z[i]});
    const float fx = std::floor(q.x * v.inverse_cell_size + v.offset.x),
                fy = std::floor(q.y * v.inverse_cell_size + v.offset.y),
                fz = std::floor(q.z * v.inverse_cell_size + v.offset.z);
    cells[k] = 0;
    if (!(fx >= 0 && fy >= 0 && fz >= 0 && fx < static_cast<float>(v.nx * kEdge) &&
          fy < static_cast<float>(v.ny * kEdge) && fz < static_cast<float>(v.nz * kEdge)))
      continue;
    const std::int32_t x = static_cast<std::int32_t>(fx), y = static_cast<std::int32_t>(fy),
                       z = static_cast<std::int32_t>(fz);
    const std::int32_t block =
        v.block[(static_cast<std::size_t>(z >> 3) * v.ny + (y >> 3)) * v.nx + (x >> 3)];
    cells[k] = block * kCells + (((z & 7) << 6) | ((y & 7) << 3) | (x & 7));
  }
}

PointBounds bound_inliers(const ScoringOrder& order, std::size_t first, const Rigid& pose,
                          const CellSummaries& v, const SummaryLimits& limits,
                          const std::int32_t* cells) {
  PointBounds out{0, 0};
  for (int k = 0; k < 64; ++k) {
    const std::size_t i = first + static_cast<std::size_t>(k);
    const std::uint32_t word = v.summary[static_cast<std::size_t>(cells[k])];
    const auto part = [&](int shift) {
      return static_cast<float>(static_cast<std::int8_t>(word >> shift)) * (1.0f / 127.0f);
    };
    const float cosine =
        dot(rotate(pose, {order.nx[i], order.ny[i], order.nz[i]}), {part(0), part(8), part(16)});
    out.possible |= static_cast<std::uint64_t>(cosine >= limits.none_below[word >> 24]) << k;
    out.certain |= static_cast<std::uint64_t>(cosine >= limits.all_above[word >> 24]) << k;
  }
  return out;
}

#endif

}  // namespace gpureg::cpu
