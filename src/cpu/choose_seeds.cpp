// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "cpu/compatibility.hpp"
#include "cpu/stages.hpp"

namespace gpureg::cpu {
namespace {

/// How many matches each of a block of rows is compatible with, itself included.
void count_compatible(const MatchSet& matches, const CompatibilityTest& test, std::size_t begin, std::size_t end, std::uint32_t* out) {
  const MatchColumns columns(matches);
  const std::uint32_t n = matches.size();
  for (std::size_t i = begin; i < end; ++i) {
    const OrientedMatch own = columns[i];
    std::uint32_t count = 0;
    for (std::uint32_t k = 0; k < n; ++k) count += compatible(columns[k], own, test) ? 1u : 0u;
    out[i] = count;
  }
}

/// 1 where no match with its source point within the separation is compatible with more.
void find_peaks(const MatchSet& m, const std::vector<std::uint32_t>& degree, float squared_separation, std::size_t begin, std::size_t end,
                std::uint8_t* out) {
  const float *px = m.px.data(), *py = m.py.data(), *pz = m.pz.data();
  const std::uint32_t* d = degree.data();
  const std::uint32_t n = m.size();
  for (std::size_t i = begin; i < end; ++i) {
    const Vec3 p{px[i], py[i], pz[i]};
    const std::uint32_t own = d[i];
    std::uint32_t more = 0;
    for (std::uint32_t k = 0; k < n; ++k)
      more |= static_cast<std::uint32_t>((d[k] > own) & (squared_norm(Vec3{px[k], py[k], pz[k]} - p) < squared_separation));
    out[i] = more == 0;
  }
}

}  // namespace

std::vector<std::vector<std::uint32_t>> choose_seeds(Exec& exec, const std::vector<MatchSet>& matches, const CompatibilityOptions& options) {
  const CompatibilityTest test = test_of(options);
  const float squared_separation = options.seed_separation * options.seed_separation;
  std::vector<std::vector<std::uint32_t>> degree(matches.size());
  std::vector<std::vector<std::uint8_t>> peak(matches.size());
  for (std::size_t p = 0; p < matches.size(); ++p) degree[p].resize(matches[p].size()), peak[p].resize(matches[p].size());
  const auto items = [&](std::size_t p) { return degree[p].size(); };
  exec.parallel_items(matches.size(), items, 256, [&](std::size_t p, std::size_t begin, std::size_t end) {
    count_compatible(matches[p], test, begin, end, degree[p].data());
  });
  exec.parallel_items(matches.size(), items, 256, [&](std::size_t p, std::size_t begin, std::size_t end) {
    find_peaks(matches[p], degree[p], squared_separation, begin, end, peak[p].data());
  });
  std::vector<std::vector<std::uint32_t>> out(matches.size());
  exec.parallel(matches.size(), [&](std::size_t p) {
    std::vector<std::uint64_t> order(degree[p].size());
    for (std::uint32_t k = 0; k < order.size(); ++k) order[k] = seed_key(seed_strength(degree[p][k], matches[p].source_weight[k] + matches[p].target_weight[k]), peak[p][k] != 0, k);
    const std::size_t count = std::min<std::size_t>(options.seeds, order.size());
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(), std::greater<>());
    for (std::size_t k = 0; k < count; ++k) out[p].push_back(match_of_seed_key(order[k]));
  });
  return out;
}

}  // namespace gpureg::cpu
