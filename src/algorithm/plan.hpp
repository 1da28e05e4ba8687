// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>

#include "math/span.hpp"
#include "math/trigonometry.hpp"

/// A scan compared with a map from above: correlative scan matching (Olson, "Real-time correlative
/// scan matching", ICRA 2009) of walls, which agree in the direction that they face.
namespace gpureg::plan {

constexpr int kDirections = 16;
/// Coarse planes of a map: one per direction, and one per direction up to the sign.
constexpr int kPlanes = kDirections * 3 / 2;
/// A score is the sum of so many bits: a byte.
constexpr int kScoreBits = 8;
constexpr std::size_t kCoarseWalls = (1u << kScoreBits) - 1;
/// Half the width of the refinement around a coarse cell, in cells and in half steps of the
/// heading.
constexpr int kAround = 3, kTurnsAround = 2;
constexpr int kEdge = 2 * kAround + 1, kTurns = 2 * kTurnsAround + 1;

/// A map from above. Cells lie in a margin of empty ones, which the walls of a scan may reach.
struct Map {
  /// Per plane and row of coarse cells: whether a cell has such a wall, as the bits of words. The
  /// last two words of a row are empty.
  const std::uint32_t* coarse;
  std::int32_t coarse_rows, coarse_words;  ///< of a plane, of a row
  const std::uint16_t* walls;          ///< per cell: the directions that walls in it face, as bits
  std::int32_t rows, stride;           ///< of `walls`
  std::int32_t coarse_margin, margin;  ///< cells
};

/// Relative to the middle of a scan, in cells; direction: of kDirections.
struct Wall {
  float x, y, direction;
};

/// A scan with one of its directions upright, and the coarse cells where its middle may be.
struct Scan {
  Span<const Wall> coarse_walls;  ///< at most kCoarseWalls, in coarse cells
  Span<const Wall> walls;
  std::int32_t headings;         ///< steps of a coarse turn, at most 256
  bool has_sides;                ///< false: a wall may face the opposite direction, too
  std::int32_t low[2], high[2];  ///< [low, high)
};

/// A cell of the middle of a scan, and a heading in steps.
struct Place {
  std::int32_t score, x, y, heading;
};

struct Heading {
  float cos, sin, turn;  ///< turn: in kDirections
};

GPUREG_HD Heading heading_of(std::int32_t step, std::int32_t steps) {
  const double angle = 2 * portable::kPi * step / steps;
  return {static_cast<float>(portable::cos(angle)), static_cast<float>(portable::sin(angle)),
          static_cast<float>(step) * kDirections / static_cast<float>(steps)};
}

struct Turned {
  std::int32_t dx, dy, direction;
};

GPUREG_HD Turned turned(const Wall& wall, const Heading& heading) {
  const auto direction = static_cast<std::int32_t>(lroundf(wall.direction + heading.turn));
  return {static_cast<std::int32_t>(lroundf(heading.cos * wall.x - heading.sin * wall.y)),
          static_cast<std::int32_t>(lroundf(heading.sin * wall.x + heading.cos * wall.y)),
          (direction % kDirections + kDirections) % kDirections};
}

/// Of a cell: the directions that a wall may face, as bits.
GPUREG_HD std::uint32_t facing_bits(std::int32_t direction, bool has_sides) {
  const std::uint32_t bit = 1u << direction;
  return has_sides ? bit : bit | 1u << (direction + kDirections / 2) % kDirections;
}

/// Where the bit of a wall is, for the middle of the scan in coarse cell (0, 0).
GPUREG_HD std::int64_t bit_of(const Map& map, const Turned& wall, bool has_sides) {
  const std::int64_t plane =
      has_sides ? wall.direction : kDirections + wall.direction % (kDirections / 2);
  const std::int64_t row = plane * map.coarse_rows + map.coarse_margin + wall.dy;
  return row * map.coarse_words * 32 + map.coarse_margin + wall.dx;
}

/// Many scores at once: bit k of bits[b] is bit b of score k.
template <typename Word>
struct Scores {
  Word bits[kScoreBits];
};

template <typename Word>
GPUREG_HD void add_bits(Word& sum, const Word& a, const Word& b, Word& carry) {
  const Word either = sum ^ a;
  carry = (sum & a) | (either & b);
  sum = either ^ b;
}

/// Adds eight bits to each score.
template <typename Word>
GPUREG_HD void add_eight(const Word (&v)[8], Scores<Word>& scores) {
  Word two_a, two_b, four_a, four_b, eight;
  Word* s = scores.bits;
  add_bits(s[0], v[0], v[1], two_a);
  add_bits(s[0], v[2], v[3], two_b);
  add_bits(s[1], two_a, two_b, four_a);
  add_bits(s[0], v[4], v[5], two_a);
  add_bits(s[0], v[6], v[7], two_b);
  add_bits(s[1], two_a, two_b, four_b);
  add_bits(s[2], four_a, four_b, eight);
  for (int b = 3; b < kScoreBits; ++b) {
    const Word carry = s[b] & eight;
    s[b] ^= eight;
    eight = carry;
  }
}

/// Bits of the scores that are at least `least`.
template <typename Word>
GPUREG_HD Word at_least(const Scores<Word>& scores, std::uint32_t least) {
  Word above = scores.bits[0] ^ scores.bits[0], equal = ~above;
  if (least >> kScoreBits != 0) return above;
  for (int b = kScoreBits - 1; b >= 0; --b) {
    if (least >> b & 1) {
      equal &= scores.bits[b];
    } else {
      above |= equal & scores.bits[b];
      equal &= ~scores.bits[b];
    }
  }
  return above | equal;
}

/// The least score from 1 on that at most `most` cells reach; counts: cells of each score.
template <typename Count>
GPUREG_HD std::int32_t least_score(const Count* counts, std::uint64_t most) {
  std::int32_t least = 1 << kScoreBits;
  for (std::uint64_t sum = 0; least > 1; --least) {
    sum += counts[least - 1];
    if (sum > most) break;
  }
  return least;
}

}  // namespace gpureg::plan
