// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "fragments.hpp"

namespace gpureg::bench {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// One call per pair: the median, as pairs differ, and the worst.
void report_each(benchmark::State& state, const std::vector<RegistrationResult>& results,
                 std::vector<double> ms) {
  report(state, results, 1);
  std::sort(ms.begin(), ms.end());
  state.counters.erase("ms_per_pair");
  state.counters["ms_median"] = ms[ms.size() / 2];
  state.counters["ms_worst"] = ms.back();
}

/// "loopsmart_all": every quadruple that passes the polygon test is scored, as in the paper.
RegistrationOptions preset(const std::string& name) {
  if (name == "default") return RegistrationOptions{0.05f};
  RegistrationOptions options = RegistrationOptions::loopsmart();
  if (name == "loopsmart_all") options.tune = kAllSurvivors;
  return options;
}

/// All pairs of the scene, `repeats` times over, on prepared clouds.
void align_many(benchmark::State& state, const std::string& backend,
                const std::string& options_name) {
  const Context* on = context(state, backend);
  if (!on) return;
  const RegistrationOptions options = preset(options_name);
  const auto clouds = prepare_batch(*on, views(), options);
  std::vector<Pair> pairs;
  for (std::int64_t k = 0; k < state.range(0); ++k)
    for (const Pair& pair : all_pairs()) pairs.push_back(pair);
  std::vector<RegistrationResult> results = align_batch(*on, clouds, all_pairs(), options);
  std::size_t runs = 0;
  for (auto _ : state) {
    results = align_batch(*on, clouds, pairs, options);
    ++runs;
  }
  report(state, results, runs);
}

/// One prepared pair at a time, every pair in turn.
void align_one(benchmark::State& state, const std::string& backend,
               const std::string& options_name) {
  const Context* on = context(state, backend);
  if (!on) return;
  const RegistrationOptions options = preset(options_name);
  const auto clouds = prepare_batch(*on, views(), options);
  const auto pairs = all_pairs();
  std::vector<RegistrationResult> results{
      align(*on, clouds[pairs[0].source], clouds[pairs[0].target], options)};
  results.clear();
  std::vector<double> ms;
  for (auto _ : state) {
    const Pair& pair = pairs[results.size() * 7 % pairs.size()];
    const auto begin = Clock::now();
    results.push_back(align(*on, clouds[pair.source], clouds[pair.target], options));
    ms.push_back(since(begin));
  }
  report_each(state, results, ms);
}

/// All pairs one at a time, by several threads that share the context.
void align_from_threads(benchmark::State& state, const std::string& backend,
                        const std::string& options_name) {
  const Context* on = context(state, backend);
  if (!on) return;
  const RegistrationOptions options = preset(options_name);
  const auto clouds = prepare_batch(*on, views(), options);
  const auto pairs = all_pairs();
  std::vector<RegistrationResult> results(pairs.size());
  const auto align_all = [&] {
    std::atomic<std::size_t> next{0};
    std::vector<std::thread> threads;
    for (std::int64_t t = 0; t < state.range(0); ++t)
      threads.emplace_back([&] {
        for (std::size_t p = next++; p < pairs.size(); p = next++)
          results[p] = align(*on, clouds[pairs[p].source], clouds[pairs[p].target], options);
      });
    for (std::thread& thread : threads) thread.join();
  };
  align_all();
  std::size_t runs = 0;
  for (auto _ : state) {
    align_all();
    ++runs;
  }
  report(state, results, runs);
}

/// From raw points in host memory to the pose.
void raw_to_pose(benchmark::State& state, const std::string& backend,
                 const std::string& options_name) {
  const Context* on = context(state, backend);
  if (!on) return;
  const RegistrationOptions options = preset(options_name);
  const auto all = views();
  const auto pairs = all_pairs();
  align(*on, all[pairs[0].source], all[pairs[0].target], options);
  std::vector<RegistrationResult> results;
  std::vector<double> ms;
  for (auto _ : state) {
    const Pair& pair = pairs[results.size() * 7 % pairs.size()];
    const auto begin = Clock::now();
    results.push_back(align(*on, all[pair.source], all[pair.target], options));
    ms.push_back(since(begin));
  }
  report_each(state, results, ms);
}

/// As large as Redwood's four scenes, 207 fragments and 5,280 pairs, from raw points in host
/// memory: the fragments come round again and again, and no fragment meets itself. Cold: the
/// context has seen the scene once and its pairs only. ms_warm: the same once more.
void redwood_sized(benchmark::State& state, const std::string& backend,
                   const std::string& options_name) {
  if (!context(state, backend)) return;
  const RegistrationOptions options = preset(options_name);
  const auto scene = views();
  std::vector<PointCloudView> raw;
  for (std::size_t k = 0; k < 207; ++k) raw.push_back(scene[k % scene.size()]);
  std::vector<Pair> pairs;
  for (std::uint32_t step = 1; pairs.size() < 5280; ++step)
    for (std::uint32_t i = 0; i + step < 207 && pairs.size() < 5280; ++i)
      if (step % scene.size() != 0) pairs.push_back({i + step, i});
  // A new context: memory reserved by other benchmarks would hide the use of this one.
  const Context on = new_context(backend);
  align_batch(on, prepare_batch(on, scene, options), all_pairs(), options);
  std::vector<RegistrationResult> results;
  std::size_t runs = 0;
  double prepare_ms = 0;
  const auto run = [&] {
    const auto begin = Clock::now();
    const auto clouds = prepare_batch(on, raw, options);
    prepare_ms += since(begin);
    results = align_batch(on, clouds, pairs, options);
  };
  for (auto _ : state) {
    run();
    ++runs;
  }
  report(state, results, runs);
  state.counters["ms_prepare"] = prepare_ms / static_cast<double>(runs);
  report_memory(state, on);
  const auto begin = Clock::now();
  run();
  state.counters["ms_warm"] = since(begin);
}

void seven_cold_runs(benchmark::internal::Benchmark* b) {
  b->Iterations(1)->Repetitions(7)->Apply(elapsed);
}

BENCHMARK_CAPTURE(align_many, cuda_loopsmart, "cuda", "loopsmart")->Arg(11)->Apply(elapsed);
BENCHMARK_CAPTURE(align_many, cuda_loopsmart_all, "cuda", "loopsmart_all")->Arg(11)->Apply(elapsed);
BENCHMARK_CAPTURE(align_many, cuda_default, "cuda", "default")->Arg(11)->Apply(elapsed);
BENCHMARK_CAPTURE(align_many, cuda_all_default, "cuda_all", "default")->Arg(11)->Apply(elapsed);
BENCHMARK_CAPTURE(align_one, cuda_loopsmart, "cuda", "loopsmart")->Iterations(190)->Apply(elapsed);
BENCHMARK_CAPTURE(align_one, cuda_default, "cuda", "default")->Iterations(190)->Apply(elapsed);
BENCHMARK_CAPTURE(align_from_threads, cuda_default, "cuda", "default")
    ->Arg(1)
    ->Arg(2)
    ->Arg(4)
    ->Arg(8)
    ->Apply(elapsed);
BENCHMARK_CAPTURE(raw_to_pose, cuda_loopsmart, "cuda", "loopsmart")
    ->Iterations(100)
    ->Apply(elapsed);
BENCHMARK_CAPTURE(redwood_sized, cuda, "cuda", "loopsmart")->Apply(seven_cold_runs);
BENCHMARK_CAPTURE(redwood_sized, cuda_default, "cuda", "default")->Apply(seven_cold_runs);
BENCHMARK_CAPTURE(redwood_sized, cuda_all, "cuda_all", "loopsmart")->Apply(seven_cold_runs);
BENCHMARK_CAPTURE(align_many, cpu_loopsmart, "cpu", "loopsmart")
    ->Arg(1)
    ->Iterations(1)
    ->Apply(elapsed);

}  // namespace
}  // namespace gpureg::bench
