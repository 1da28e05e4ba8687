// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <limits>

#include "math/philox.hpp"
#include "math/vec3.hpp"

namespace gpureg {

/// Philox counter word 3, one constant per use of randomness: order of matches, members of
/// triangles.
constexpr std::uint32_t kTagMatch = 0x4d415443u;     ///< "MATC"
constexpr std::uint32_t kTagTriangle = 0x54524941u;  ///< "TRIA"

/// Points and normals of a match, for the compatibility test.
struct OrientedMatch {
  Vec3 p, q;  ///< in the source, in the target
  Vec3 m, n;  ///< normals of p, of q
};

/// Tolerances of the compatibility test.
struct CompatibilityTest {
  float squared_tolerance;  ///< of the distances
  float largest_turn;       ///< of the cosines; its square is the largest within the limit
};

/// Host only. The limit of the cosines is one of their rounded squares, so that the test without
/// squares has the same result.
inline CompatibilityTest compatibility_test(float tolerance, float max_turn) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float squared_turn = max_turn * max_turn;
  float largest = max_turn;
  while (largest * largest > squared_turn) largest = std::nextafter(largest, 0.0f);
  for (float next = largest; next * next <= squared_turn; next = std::nextafter(next, kInfinity))
    largest = next;
  return {tolerance * tolerance, largest};
}

/// Two lengths differ by less than the tolerance. a, b: their squares. Without roots: with x =
/// (sqrt(a) - sqrt(b))^2 it is (a - b)^2 = x (2 (a + b) - x), which grows with x.
GPUREG_HD bool similar_lengths(float a, float b, float squared_tolerance) {
  const float difference = a - b, sum = a + b;
  return (difference * difference <
          fmaf(2.0f * squared_tolerance, sum, -(squared_tolerance * squared_tolerance))) |
         (sum <= squared_tolerance);
}

/// Two matches are compatible where one rigid motion may satisfy both: it keeps the distance of
/// their points (SC2-PCR, Chen et al. 2022) and the angle of their normals.
GPUREG_HD bool compatible(const OrientedMatch& a, const OrientedMatch& b,
                          const CompatibilityTest& test) {
  const float turn = dot(a.m, b.m) - dot(a.n, b.n);
  return similar_lengths(squared_norm(a.p - b.p), squared_norm(a.q - b.q), test.squared_tolerance) &
         (fabsf(turn) <= test.largest_turn);
}

/// Random rank of a match, a function of the match and the seed alone. It decides which matches are
/// kept where there are too many, and which members of a large neighbourhood take part. Indices
/// break ties.
GPUREG_HD std::uint32_t match_order(std::uint32_t source, std::uint32_t target,
                                    std::uint64_t seed) {
  return philox(source, target, 0, kTagMatch, static_cast<std::uint32_t>(seed),
                static_cast<std::uint32_t>(seed >> 32))
      .v[0];
}

/// The two members that form triangle number `trial` with the seed (member 0) of a neighbourhood of
/// `members` >= 3.
struct TrianglePick {
  std::uint32_t a, b;
};
GPUREG_HD TrianglePick pick_triangle(std::uint32_t source, std::uint32_t target,
                                     std::uint32_t trial, std::uint64_t seed,
                                     std::uint32_t members) {
  const PhiloxWords w =
      philox(source, target, trial, kTagTriangle, static_cast<std::uint32_t>(seed),
             static_cast<std::uint32_t>(seed >> 32));
  return {1 + scale_to(w.v[0], members - 1), 1 + scale_to(w.v[1], members - 1)};
}

/// True where no side of the triangle is too short to determine a direction.
GPUREG_HD bool wide_triangle(Vec3 p0, Vec3 p1, Vec3 p2, float squared_length) {
  return (squared_norm(p1 - p0) >= squared_length) & (squared_norm(p2 - p0) >= squared_length) &
         (squared_norm(p2 - p1) >= squared_length);
}

/// The degree of a match is the number of matches that are compatible with it, among the first
/// ones, which are a random sample: the rank of a match is random.
constexpr std::uint32_t kDegreeSample = 2048;

/// Bits that the strength drops, so that it fits 24 bits.
constexpr int kStrengthShift = 5;
/// Strength of a match as a seed: its degree times its normal weight, which is at most 2^17.
/// Without the weight, floors and walls with their many similar matches take all seeds.
GPUREG_HD std::uint32_t seed_strength(std::uint32_t degree, std::uint32_t weight) {
  return static_cast<std::uint32_t>((static_cast<std::uint64_t>(degree) * weight) >>
                                    kStrengthShift);
}

/// The total order of seeds: local maxima of the degree first, then the stronger, then the earlier
/// one.
GPUREG_HD std::uint64_t seed_key(std::uint32_t strength, bool peak, std::uint32_t match) {
  return (peak ? std::uint64_t(1) << 63 : 0) | (static_cast<std::uint64_t>(strength) << 32) |
         (0xffffffffu - match);
}
GPUREG_HD std::uint32_t match_of_seed_key(std::uint64_t key) {
  return 0xffffffffu - static_cast<std::uint32_t>(key);
}

}  // namespace gpureg
