// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "api/with_settings.hpp"
#include "cpu/common/stages.hpp"

namespace gpureg::cpu {
namespace {

std::vector<Matches> random_matches(std::mt19937& random, std::size_t n) {
  std::normal_distribution<float> normal;
  std::vector<Matches> out(1);
  for (std::uint32_t k = 0; k < n; ++k) {
    const Vec3 p{normal(random), normal(random), normal(random)};
    const bool right = random() % 2 == 0;
    const Vec3 q =
        right ? Vec3{p.y, p.z, p.x} : Vec3{normal(random), normal(random), normal(random)};
    // Several matches of one source point, as with neighbors > 1.
    out[0].pairs.push_back({p, q, k / 2, k});
  }
  return out;
}

TEST(Sample, KeepsExactlyThePassingQuadruples) {
  std::mt19937 random(1);
  for (const std::size_t n : {std::size_t(4), std::size_t(5), std::size_t(300)})
    for (const std::uint32_t count : {1u, 7u, 65536u, 100003u}) {
      const std::vector<Matches> matches = random_matches(random, n);
      RegistrationSettings options;
      options.quadruples.count = count;
      options.quadruples.max_survivors = count;
      options.seed = 0x123456789abcdefull + n;
      const float tau2 = options.quadruples.edge_similarity * options.quadruples.edge_similarity;
      std::vector<std::uint32_t> expected;
      for (std::uint32_t h = 0; h < count; ++h) {
        const Quadruple q = draw_quadruple(h, options.seed, static_cast<std::uint32_t>(n));
        const auto& m = matches[0].pairs;
        if (passes_polygon_test(m[q.match[0]], m[q.match[1]], m[q.match[2]], m[q.match[3]], tau2))
          expected.push_back(h);
      }
      for (const unsigned threads : {1u, 2u, 7u}) {
        Exec exec(threads);
        EXPECT_EQ(sample_quadruples(exec, matches, options)[0], expected);
      }
      if (n == 300 && count > 60000) EXPECT_GT(expected.size(), 100u);
    }
}

TEST(Sample, FewerThanFourMatchesGiveNone) {
  std::mt19937 random(2);
  Exec exec(2);
  RegistrationSettings options;
  options.quadruples.count = 1000;
  for (const std::size_t n : {std::size_t(0), std::size_t(1), std::size_t(3)})
    EXPECT_TRUE(sample_quadruples(exec, random_matches(random, n), options)[0].empty());
}

}  // namespace
}  // namespace gpureg::cpu
