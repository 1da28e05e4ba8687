// SPDX-License-Identifier: BSD-3-Clause
#include "cpu/stages.hpp"

namespace gpureg::cpu {
namespace {

constexpr std::uint32_t kBlock = 1 << 16;  // hypotheses per task
constexpr int kLanes = 16;

/// The quadruples of kLanes hypotheses side by side: the same integer steps as draw_quadruple, laid out for the vector unit.
void draw_lanes(std::uint32_t first, std::uint64_t seed, std::uint32_t count, std::uint32_t (*out)[kLanes]) {
  std::uint32_t c0[kLanes], c1[kLanes], c2[kLanes], c3[kLanes];
  for (int l = 0; l < kLanes; ++l) c0[l] = first + static_cast<std::uint32_t>(l), c1[l] = 0, c2[l] = 0, c3[l] = kTagQuadruple;
  std::uint32_t k0 = static_cast<std::uint32_t>(seed), k1 = static_cast<std::uint32_t>(seed >> 32);
  for (int round = 0; round < 10; ++round) {
    for (int l = 0; l < kLanes; ++l) {
      const std::uint64_t a = static_cast<std::uint64_t>(0xD2511F53u) * c0[l];
      const std::uint64_t b = static_cast<std::uint64_t>(0xCD9E8D57u) * c2[l];
      c0[l] = static_cast<std::uint32_t>(b >> 32) ^ c1[l] ^ k0;
      c2[l] = static_cast<std::uint32_t>(a >> 32) ^ c3[l] ^ k1;
      c1[l] = static_cast<std::uint32_t>(b);
      c3[l] = static_cast<std::uint32_t>(a);
    }
    k0 += 0x9E3779B9u;
    k1 += 0xBB67AE85u;
  }
  for (int l = 0; l < kLanes; ++l) {
    out[0][l] = scale_to(c0[l], count);
    out[1][l] = scale_to(c1[l], count);
    out[2][l] = scale_to(c2[l], count);
    out[3][l] = scale_to(c3[l], count);
  }
}

}  // namespace

std::vector<std::vector<std::uint32_t>> sample_quadruples(Exec& exec, const std::vector<Matches>& matches,
                                                          const HypothesisOptions& options) {
  const std::uint32_t blocks = (options.count + kBlock - 1) / kBlock;
  std::vector<std::vector<std::vector<std::uint32_t>>> parts(matches.size());
  for (std::size_t p = 0; p < matches.size(); ++p)
    if (matches[p].pairs.size() >= 4) parts[p].resize(blocks);
  const float tau2 = options.edge_similarity * options.edge_similarity;
  exec.parallel_items(matches.size(), [&](std::size_t p) { return parts[p].size(); }, 1, [&](std::size_t p, std::size_t block, std::size_t) {
    const std::vector<MatchedPoints>& m = matches[p].pairs;
    const std::uint32_t count = static_cast<std::uint32_t>(m.size());
    std::vector<std::uint32_t>& kept = parts[p][block];
    const std::uint64_t begin = static_cast<std::uint64_t>(block) * kBlock;
    const std::uint64_t end = begin + kBlock < options.count ? begin + kBlock : options.count;
    std::uint32_t draw[4][kLanes];
    for (std::uint64_t first = begin; first < end; first += kLanes) {
      draw_lanes(static_cast<std::uint32_t>(first), options.seed, count, draw);
      const int lanes = end - first < kLanes ? static_cast<int>(end - first) : kLanes;
      for (int l = 0; l < lanes; ++l) {
        const MatchedPoints &m0 = m[draw[0][l]], &m1 = m[draw[1][l]];
        // Most fail at their first side: nothing else is fetched for them.
        if (!similar_sides(m0, m1, tau2)) continue;
        if (passes_polygon_test(m0, m1, m[draw[2][l]], m[draw[3][l]], tau2)) kept.push_back(static_cast<std::uint32_t>(first) + l);
      }
    }
  });
  std::vector<std::vector<std::uint32_t>> out(matches.size());
  for (std::size_t p = 0; p < matches.size(); ++p)
    for (const auto& part : parts[p]) out[p].insert(out[p].end(), part.begin(), part.end());
  return out;
}

}  // namespace gpureg::cpu
