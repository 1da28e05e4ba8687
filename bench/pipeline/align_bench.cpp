// SPDX-License-Identifier: BSD-3-Clause
#include "fragments.hpp"

namespace gpureg::bench {
namespace {

void report(benchmark::State& state, const std::vector<RegistrationResult>& results, std::size_t runs) {
  StageTimings sum;
  double survivors = 0, aligned = 0, points = 0;
  for (const RegistrationResult& r : results) {
    sum.match += r.timings.match, sum.sample += r.timings.sample, sum.fit += r.timings.fit;
    sum.score += r.timings.score, sum.refine += r.timings.refine, sum.judge += r.timings.judge;
    survivors += static_cast<double>(r.statistics.survivors), aligned += r.aligned(), points += r.statistics.source_points;
  }
  const double n = static_cast<double>(results.size());
  state.counters["pairs"] = n;
  state.counters["aligned"] = aligned;
  state.counters["points"] = points / n;
  state.counters["survivors"] = survivors / n;
  state.counters["ms_match"] = sum.match / n;
  state.counters["ms_sample"] = sum.sample / n;
  state.counters["ms_fit"] = sum.fit / n;
  state.counters["ms_score"] = sum.score / n;
  state.counters["ms_refine"] = sum.refine / n;
  state.counters["ms_judge"] = sum.judge / n;
  state.counters["ms_per_pair"] =
      benchmark::Counter(n * static_cast<double>(runs) * 1e-3, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

RegistrationOptions preset(const std::string& name) {
  return name == "loopsmart" ? RegistrationOptions::loopsmart() : RegistrationOptions::from_voxel_size(0.05f);
}

/// All pairs of the scene, `repeats` times over, on prepared clouds.
void align_many(benchmark::State& state, const std::string& backend, const std::string& options_name) {
  const Context* on = context(state, backend);
  if (!on) return;
  const RegistrationOptions options = preset(options_name);
  const auto clouds = prepare_batch(*on, views(), options.prepare);
  std::vector<Pair> pairs;
  for (std::int64_t k = 0; k < state.range(0); ++k)
    for (const Pair& pair : all_pairs()) pairs.push_back(pair);
  std::vector<RegistrationResult> results = align_batch(*on, clouds, all_pairs(), options);
  std::size_t runs = 0;
  for (auto _ : state) results = align_batch(*on, clouds, pairs, options), ++runs;
  report(state, results, runs);
}

/// One prepared pair at a time, every pair in turn.
void align_one(benchmark::State& state, const std::string& backend, const std::string& options_name) {
  const Context* on = context(state, backend);
  if (!on) return;
  const RegistrationOptions options = preset(options_name);
  const auto clouds = prepare_batch(*on, views(), options.prepare);
  const auto pairs = all_pairs();
  std::vector<RegistrationResult> result{align(*on, clouds[pairs[0].source], clouds[pairs[0].target], options)};
  std::size_t runs = 0;
  for (auto _ : state) {
    const Pair& pair = pairs[runs++ * 7 % pairs.size()];
    result[0] = align(*on, clouds[pair.source], clouds[pair.target], options);
  }
  report(state, result, runs);
}

/// From raw points in host memory to the pose.
void raw_to_pose(benchmark::State& state, const std::string& backend, const std::string& options_name) {
  const Context* on = context(state, backend);
  if (!on) return;
  const RegistrationOptions options = preset(options_name);
  const auto all = views();
  const auto pairs = all_pairs();
  std::vector<RegistrationResult> result{align(*on, all[pairs[0].source], all[pairs[0].target], options)};
  std::size_t runs = 0;
  for (auto _ : state) {
    const Pair& pair = pairs[runs++ * 7 % pairs.size()];
    result[0] = align(*on, all[pair.source], all[pair.target], options);
  }
  report(state, result, runs);
}

BENCHMARK_CAPTURE(align_many, cuda_loopsmart, "cuda", "loopsmart")->Arg(11)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(align_many, cuda_default, "cuda", "default")->Arg(11)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(align_one, cuda_loopsmart, "cuda", "loopsmart")->Iterations(190)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(align_one, cuda_default, "cuda", "default")->Iterations(190)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(raw_to_pose, cuda_loopsmart, "cuda", "loopsmart")->Iterations(100)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(align_many, cpu_loopsmart, "cpu", "loopsmart")->Arg(1)->Iterations(1)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace gpureg::bench
