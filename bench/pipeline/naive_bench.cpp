// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>

#include "api/access.hpp"
#include "fragments.hpp"
#include "naive.hpp"

namespace gpureg::bench {
namespace {

/// Algorithm 1 as it reads, one pair after the other, every pair of the scene. The library's
/// results are the measure of its own.
void paper_mode(benchmark::State& state) {
  const Context* on = context(state, "cuda");
  if (!on) return;
  RegistrationOptions options = RegistrationOptions::loopsmart();
  options.tune = kAllSurvivors;
  const auto clouds = prepare_batch(*on, views(), options);
  const auto pairs = all_pairs();
  const auto expected = align_batch(*on, clouds, pairs, options);
  std::size_t most = 0;
  for (const PreparedCloud& cloud : clouds) most = std::max(most, cloud.size());
  Naive naive(most, resolve(options));
  for (const PreparedCloud& cloud : clouds) naive.grid_of(*Access::state(cloud));
  naive.align(*Access::state(clouds[pairs[0].source]), *Access::state(clouds[pairs[0].target]));
  std::vector<double> ms;
  for (auto _ : state) {
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      const auto begin = std::chrono::steady_clock::now();
      const NaiveResult found = naive.align(*Access::state(clouds[pairs[p].source]),
                                            *Access::state(clouds[pairs[p].target]));
      ms.push_back(
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
              .count());
      if (found.survivors != expected[p].statistics.survivors ||
          found.best.inliers != expected[p].statistics.consensus)
        return state.SkipWithError("the naive mode finds something else than the library");
    }
  }
  double sum = 0;
  for (const double one : ms) sum += one;
  std::sort(ms.begin(), ms.end());
  state.counters["pairs"] = static_cast<double>(pairs.size());
  state.counters["ms_per_pair"] = sum / static_cast<double>(ms.size());
  state.counters["ms_median"] = ms[ms.size() / 2];
  state.counters["ms_worst"] = ms.back();
}

BENCHMARK(paper_mode)->Iterations(1)->Apply(elapsed);

}  // namespace
}  // namespace gpureg::bench
