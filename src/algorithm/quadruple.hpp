// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "math/philox.hpp"
#include "math/vec3.hpp"

namespace gpureg {

/// A feature match with both its points: the sampler reads one cache line instead of two.
struct MatchedPoints {
  Vec3 source;
  Vec3 target;
  std::uint32_t source_index;
  std::uint32_t target_index;
};

/// Philox counter word 3, one constant per use of randomness.
constexpr std::uint32_t kTagQuadruple = 0x51554144u;  ///< "QUAD"

struct Quadruple {
  std::uint32_t match[4];
};

/// The four matches of one hypothesis. A function of (seed, hypothesis, count) only: without the
/// pair number a pair has the same result alone and in any batch.
GPUREG_HD Quadruple draw_quadruple(std::uint32_t hypothesis, std::uint64_t seed,
                                   std::uint32_t count) {
  const PhiloxWords w = philox(hypothesis, 0, 0, kTagQuadruple, static_cast<std::uint32_t>(seed),
                               static_cast<std::uint32_t>(seed >> 32));
  return {{scale_to(w.v[0], count), scale_to(w.v[1], count), scale_to(w.v[2], count),
           scale_to(w.v[3], count)}};
}

/// One side of the polygon test: lengths within the ratio tau of each other, either way (Algorithm
/// 1). Squared, so without a root.
GPUREG_HD bool similar_sides(const MatchedPoints& a, const MatchedPoints& b,
                             float squared_similarity) {
  const float p = squared_norm(a.source - b.source);
  const float q = squared_norm(a.target - b.target);
  return p >= squared_similarity * q && q >= squared_similarity * p;
}

/// True where no source point repeats and all four sides are similar.
GPUREG_HD bool passes_polygon_test(const MatchedPoints& m0, const MatchedPoints& m1,
                                   const MatchedPoints& m2, const MatchedPoints& m3,
                                   float squared_similarity) {
  return similar_sides(m0, m1, squared_similarity) && similar_sides(m1, m2, squared_similarity) &&
         similar_sides(m2, m3, squared_similarity) && similar_sides(m3, m0, squared_similarity) &&
         m0.source_index != m1.source_index && m0.source_index != m2.source_index &&
         m0.source_index != m3.source_index && m1.source_index != m2.source_index &&
         m1.source_index != m3.source_index && m2.source_index != m3.source_index;
}

}  // namespace gpureg
