// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "cpu/common/stages.hpp"

#if defined(__AVX2__)
#include <immintrin.h>
#endif

namespace gpureg::cpu {
namespace {

static_assert(sizeof(MatchedPoints) == 8 * sizeof(float), "first_sides steps by eight floats");
constexpr std::uint32_t kHypothesesPerTask = 1 << 16;
constexpr int kDrawnTogether = 8;

/// The quadruples of kDrawnTogether hypotheses at once, out[draw][lane]: the same integer steps as
/// draw_quadruple.
#if defined(__AVX2__)
/// Low and high words of the products of eight words with a constant.
inline void multiply(__m256i a, std::uint32_t factor, __m256i& low, __m256i& high) {
  const __m256i f = _mm256_set1_epi32(static_cast<int>(factor));
  const __m256i even = _mm256_mul_epu32(a, f), odd = _mm256_mul_epu32(_mm256_srli_epi64(a, 32), f);
  low = _mm256_blend_epi32(even, _mm256_slli_epi64(odd, 32), 0xaa);
  high = _mm256_blend_epi32(_mm256_srli_epi64(even, 32), odd, 0xaa);
}

void draw_lanes(std::uint32_t first, std::uint64_t seed, std::uint32_t count,
                std::uint32_t (*out)[kDrawnTogether]) {
  static_assert(kDrawnTogether == 8, "one vector register");
  __m256i c0 = _mm256_add_epi32(_mm256_set1_epi32(static_cast<int>(first)),
                                _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
  __m256i c1 = _mm256_setzero_si256(), c2 = c1,
          c3 = _mm256_set1_epi32(static_cast<int>(kTagQuadruple));
  std::uint32_t k0 = static_cast<std::uint32_t>(seed), k1 = static_cast<std::uint32_t>(seed >> 32);
  for (int round = 0; round < 10; ++round) {
    __m256i low0, high0, low2, high2;
    multiply(c0, 0xD2511F53u, low0, high0);
    multiply(c2, 0xCD9E8D57u, low2, high2);
    c0 = _mm256_xor_si256(_mm256_xor_si256(high2, c1), _mm256_set1_epi32(static_cast<int>(k0)));
    c2 = _mm256_xor_si256(_mm256_xor_si256(high0, c3), _mm256_set1_epi32(static_cast<int>(k1)));
    c1 = low2;
    c3 = low0;
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
  const __m256i words[4] = {c0, c1, c2, c3};
  for (int d = 0; d < 4; ++d) {
    __m256i low, high;
    multiply(words[d], count, low, high);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out[d]), high);
  }
}
#else
void draw_lanes(std::uint32_t first, std::uint64_t seed, std::uint32_t count,
                std::uint32_t (*out)[kDrawnTogether]) {
  for (int l = 0; l < kDrawnTogether; ++l) {
    const Quadruple q = draw_quadruple(first + static_cast<std::uint32_t>(l), seed, count);
    for (int d = 0; d < 4; ++d) out[d][l] = q.match[d];
  }
}
#endif

/// Bit l is set where the first side of lane l's quadrilateral passes the polygon test.
#if defined(__AVX2__) && defined(__FMA__)
unsigned first_sides(const MatchedPoints* m, const std::uint32_t (*draw)[kDrawnTogether],
                     float tau2) {
  // Eight matches of 32 bytes to six vectors of one coordinate each, by gathers with a stride:
  // float k of match i is at 8 i + k.
  const float* base = reinterpret_cast<const float*>(m);
  const __m256i i0 =
      _mm256_slli_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(draw[0])), 3);
  const __m256i i1 =
      _mm256_slli_epi32(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(draw[1])), 3);
  const auto difference = [&](int k) {
    return _mm256_sub_ps(_mm256_i32gather_ps(base + k, i0, 4),
                         _mm256_i32gather_ps(base + k, i1, 4));
  };
  const auto squared = [&](int k) {
    const __m256 x = difference(k), y = difference(k + 1), z = difference(k + 2);
    return _mm256_fmadd_ps(z, z, _mm256_fmadd_ps(y, y, _mm256_mul_ps(x, x)));
  };
  const __m256 p = squared(0), q = squared(3), tau = _mm256_set1_ps(tau2);
  const __m256 pass = _mm256_and_ps(_mm256_cmp_ps(p, _mm256_mul_ps(tau, q), _CMP_GE_OQ),
                                    _mm256_cmp_ps(q, _mm256_mul_ps(tau, p), _CMP_GE_OQ));
  return static_cast<unsigned>(_mm256_movemask_ps(pass));
}
#else
unsigned first_sides(const MatchedPoints* m, const std::uint32_t (*draw)[kDrawnTogether],
                     float tau2) {
  unsigned mask = 0;
  for (int l = 0; l < kDrawnTogether; ++l)
    mask |= static_cast<unsigned>(similar_sides(m[draw[0][l]], m[draw[1][l]], tau2)) << l;
  return mask;
}
#endif

}  // namespace

std::vector<std::vector<std::uint32_t>> sample_quadruples(Exec& exec,
                                                          const std::vector<Matches>& matches,
                                                          const RegistrationSettings& options) {
  const std::uint32_t blocks =
      (options.quadruples.count + kHypothesesPerTask - 1) / kHypothesesPerTask;
  std::vector<std::vector<std::vector<std::uint32_t>>> parts(matches.size());
  for (std::size_t p = 0; p < matches.size(); ++p)
    if (matches[p].pairs.size() >= 4) parts[p].resize(blocks);
  const float tau2 = options.quadruples.edge_similarity * options.quadruples.edge_similarity;
  exec.parallel_items(
      matches.size(), [&](std::size_t p) { return parts[p].size(); }, 1,
      [&](std::size_t p, std::size_t block, std::size_t) {
        const std::vector<MatchedPoints>& m = matches[p].pairs;
        const std::uint32_t count = static_cast<std::uint32_t>(m.size());
        std::vector<std::uint32_t>& kept = parts[p][block];
        const std::uint64_t begin = static_cast<std::uint64_t>(block) * kHypothesesPerTask;
        const std::uint64_t end = begin + kHypothesesPerTask < options.quadruples.count
                                      ? begin + kHypothesesPerTask
                                      : options.quadruples.count;
        std::uint32_t draw[4][kDrawnTogether];
        for (std::uint64_t first = begin; first < end; first += kDrawnTogether) {
          draw_lanes(static_cast<std::uint32_t>(first), options.seed, count, draw);
          const int lanes =
              end - first < kDrawnTogether ? static_cast<int>(end - first) : kDrawnTogether;
          // Most hypotheses fail at their first side, so only its matches are fetched.
          for (unsigned mask = first_sides(m.data(), draw, tau2) & ((1u << lanes) - 1); mask != 0;
               mask &= mask - 1) {
            const int l = __builtin_ctz(mask);
            if (passes_polygon_test(m[draw[0][l]], m[draw[1][l]], m[draw[2][l]], m[draw[3][l]],
                                    tau2))
              kept.push_back(static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(l));
          }
        }
      });
  std::vector<std::vector<std::uint32_t>> out(matches.size());
  for (std::size_t p = 0; p < matches.size(); ++p)
    for (const auto& part : parts[p]) {
      const std::size_t room = options.quadruples.max_survivors - out[p].size();
      out[p].insert(out[p].end(), part.begin(),
                    part.begin() + static_cast<std::ptrdiff_t>(std::min(room, part.size())));
    }
  return out;
}

}  // namespace gpureg::cpu
