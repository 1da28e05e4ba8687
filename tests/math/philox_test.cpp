// SPDX-License-Identifier: BSD-3-Clause
#include "math/philox.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace gpureg {
namespace {

void expect_words(const PhiloxWords& w, std::uint32_t a, std::uint32_t b, std::uint32_t c,
                  std::uint32_t d) {
  EXPECT_EQ(w.v[0], a);
  EXPECT_EQ(w.v[1], b);
  EXPECT_EQ(w.v[2], c);
  EXPECT_EQ(w.v[3], d);
}

// Known answers published with Random123 (Salmon et al. 2011) for philox4x32-10.
TEST(Philox, KnownAnswers) {
  expect_words(philox(0, 0, 0, 0, 0, 0), 0x6627e8d5u, 0xe169c58du, 0xbc57ac4cu, 0x9b00dbd8u);
  expect_words(philox(~0u, ~0u, ~0u, ~0u, ~0u, ~0u), 0x408f276du, 0x41c83b0eu, 0xa20bc7c6u,
               0x6d5451fdu);
  expect_words(philox(0x243f6a88u, 0x85a308d3u, 0x13198a2eu, 0x03707344u, 0xa4093822u, 0x299f31d0u),
               0xd16cfe09u, 0x94fdccebu, 0x5001e420u, 0x24126ea1u);
}

TEST(Philox, ScaleStaysInRangeAndIsEven) {
  std::vector<int> hits(7, 0);
  for (std::uint32_t k = 0; k < 70000; ++k) ++hits[scale_to(philox(k, 0, 0, 0, 1, 2).v[0], 7)];
  // 10,000 expected each; 5 standard deviations of a binomial are 460.
  for (const int h : hits) EXPECT_NEAR(h, 10000, 460);
  EXPECT_EQ(scale_to(~0u, 5), 4u);
  EXPECT_EQ(scale_to(0, 5), 0u);
}

}  // namespace
}  // namespace gpureg
