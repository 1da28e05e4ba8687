// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <numeric>

#include "cpu/common/stages.hpp"
#include "cpu/common/wide_vectors.hpp"
#include "cpu/compatibility/compatibility.hpp"

namespace gpureg::cpu {
namespace {

constexpr std::uint32_t kRows = 4;  // rows per pass: the columns are loaded once for all of them

/// Degrees of the matches [begin, end), see kDegreeSample. out: one per match.
GPUREG_ALWAYS_INLINE void count_compatible_in_vectors(const MatchSet& matches,
                                                      const CompatibilityTest& test,
                                                      std::uint32_t begin, std::uint32_t end,
                                                      std::uint32_t* out) {
  const MatchColumns columns(matches);
  const std::uint32_t sample = std::min(matches.size(), kDegreeSample);
  std::uint32_t i = begin;
  for (; i + kRows <= end; i += kRows) {
    const OrientedMatch a = columns[i], b = columns[i + 1], c = columns[i + 2], d = columns[i + 3];
    std::uint32_t of_a = 0, of_b = 0, of_c = 0, of_d = 0;
    for (std::uint32_t k = 0; k < sample; ++k) {
      const OrientedMatch other = columns[k];
      of_a += compatible(other, a, test) ? 1u : 0u;
      of_b += compatible(other, b, test) ? 1u : 0u;
      of_c += compatible(other, c, test) ? 1u : 0u;
      of_d += compatible(other, d, test) ? 1u : 0u;
    }
    out[i] = of_a;
    out[i + 1] = of_b;
    out[i + 2] = of_c;
    out[i + 3] = of_d;
  }
  for (; i < end; ++i) {
    const OrientedMatch own = columns[i];
    std::uint32_t count = 0;
    for (std::uint32_t k = 0; k < sample; ++k) count += compatible(columns[k], own, test) ? 1u : 0u;
    out[i] = count;
  }
}

#ifdef GPUREG_WIDE_TARGET
GPUREG_WIDE_TARGET void count_compatible_wide(const MatchSet& matches,
                                              const CompatibilityTest& test, std::uint32_t begin,
                                              std::uint32_t end, std::uint32_t* out) {
  count_compatible_in_vectors(matches, test, begin, end, out);
}
#endif

void count_compatible(const MatchSet& matches, const CompatibilityTest& test, std::uint32_t begin,
                      std::uint32_t end, std::uint32_t* out) {
#ifdef GPUREG_WIDE_TARGET
  if (has_wide_vectors()) return count_compatible_wide(matches, test, begin, end, out);
#endif
  count_compatible_in_vectors(matches, test, begin, end, out);
}

/// Matches in the order of their source points along the longest axis of the cloud, so that
/// neighbours are close in the order.
struct Sorted {
  std::vector<float> px, py, pz;
  std::vector<std::uint32_t> match, degree;
  const std::vector<float>* along = &px;

  Sorted(const MatchSet& m, const std::vector<std::uint32_t>& degrees) : match(m.size()) {
    const std::vector<float>* axes[3] = {&m.px, &m.py, &m.pz};
    const auto extent = [](const std::vector<float>& v) {
      const auto ends = std::minmax_element(v.begin(), v.end());
      return v.empty() ? 0.0f : *ends.second - *ends.first;
    };
    int axis = 0;
    for (int k = 1; k < 3; ++k) axis = extent(*axes[k]) > extent(*axes[axis]) ? k : axis;
    std::iota(match.begin(), match.end(), 0u);
    std::sort(match.begin(), match.end(), [&](std::uint32_t a, std::uint32_t b) {
      // A total order: the order of equal coordinates must not depend on the library's sort.
      const float first = (*axes[axis])[a], second = (*axes[axis])[b];
      return first != second ? first < second : a < b;
    });
    for (const std::uint32_t k : match) {
      px.push_back(m.px[k]);
      py.push_back(m.py[k]);
      pz.push_back(m.pz[k]);
      degree.push_back(degrees[k]);
    }
    along = axis == 0 ? &px : axis == 1 ? &py : &pz;
  }
  Sorted(const Sorted&) = delete;
  Sorted& operator=(const Sorted&) = delete;
};

/// 1 where no match with its source point within the separation has more compatible matches.
void find_peaks(const MatchSet& m, const std::vector<std::uint32_t>& degrees,
                float squared_separation, std::uint8_t* out) {
  const Sorted s(m, degrees);
  const float *px = s.px.data(), *py = s.py.data(), *pz = s.pz.data(), *along = s.along->data();
  const std::uint32_t* degree = s.degree.data();
  const std::uint32_t n = m.size();
  // Rounding is monotone: a squared norm is never below the square of one of its coordinates, so no
  // match outside the range is near.
  const auto apart = [&](std::uint32_t a, std::uint32_t b) {
    return !((along[b] - along[a]) * (along[b] - along[a]) < squared_separation);
  };
  std::uint32_t first = 0, last = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    while (first < i && apart(first, i)) ++first;
    while (last < n && (last <= i || !apart(i, last))) ++last;
    const Vec3 p{px[i], py[i], pz[i]};
    const std::uint32_t own = degree[i];
    std::uint32_t more = 0;
    for (std::uint32_t k = first; k < last; ++k)
      more |= static_cast<std::uint32_t>(
          (degree[k] > own) & (squared_norm(Vec3{px[k], py[k], pz[k]} - p) < squared_separation));
    out[s.match[i]] = more == 0;
  }
}

}  // namespace

std::vector<std::vector<std::uint32_t>> choose_seeds(Exec& exec,
                                                     const std::vector<MatchSet>& matches,
                                                     const RegistrationSettings& options) {
  const CompatibilityTest test = test_of(options.compatibility);
  const float squared_separation =
      options.compatibility.seed_separation * options.compatibility.seed_separation;
  std::vector<std::vector<std::uint32_t>> degree(matches.size());
  std::vector<std::vector<std::uint8_t>> peak(matches.size());
  for (std::size_t p = 0; p < matches.size(); ++p) {
    degree[p].resize(matches[p].size());
    peak[p].resize(matches[p].size());
  }
  constexpr std::size_t kGrain = 512;  // rows per task: milliseconds of work
  exec.parallel_items(
      matches.size(), [&](std::size_t p) { return degree[p].size(); }, kGrain,
      [&](std::size_t p, std::size_t begin, std::size_t end) {
        count_compatible(matches[p], test, static_cast<std::uint32_t>(begin),
                         static_cast<std::uint32_t>(end), degree[p].data());
      });
  exec.parallel(matches.size(), [&](std::size_t p) {
    find_peaks(matches[p], degree[p], squared_separation, peak[p].data());
  });
  std::vector<std::vector<std::uint32_t>> out(matches.size());
  exec.parallel(matches.size(), [&](std::size_t p) {
    std::vector<std::uint64_t> order(degree[p].size());
    for (std::uint32_t k = 0; k < order.size(); ++k)
      order[k] = seed_key(
          seed_strength(degree[p][k], matches[p].source_weight[k] + matches[p].target_weight[k]),
          peak[p][k] != 0, k);
    const std::size_t count = std::min<std::size_t>(options.compatibility.seeds, order.size());
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count),
                      order.end(), std::greater<>());
    for (std::size_t k = 0; k < count; ++k) out[p].push_back(match_of_seed_key(order[k]));
  });
  return out;
}

}  // namespace gpureg::cpu
