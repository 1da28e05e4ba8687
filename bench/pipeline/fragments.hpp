// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <benchmark/benchmark.h>

#include <cstdint>
#include <string>
#include <vector>

#include "gpureg/registration.hpp"

/// What the benchmarks of the whole pipeline work on: the fragments of one scene, read once. The
/// folder is GPUREG_BENCH_SCENE, else redkitchen/fragments in GPUREG_DATA_DIR.
namespace gpureg::bench {

const std::vector<PointCloud>& fragments();
std::vector<PointCloudView> views();
/// Every pair once.
std::vector<Pair> all_pairs();

/// RegistrationOptions::tune, of a number that real pairs stay below.
constexpr const char* kAllSurvivors = "quadruples.max_survivors=262144";

/// Means over the results, and milliseconds per pair of that many runs.
void report(benchmark::State& state, const std::vector<RegistrationResult>& results,
            std::size_t runs);
/// Memory that the context has reserved on its devices.
void report_memory(benchmark::State& state, const Context& context);

/// Elapsed milliseconds, not those of the processor.
inline void elapsed(benchmark::internal::Benchmark* b) {
  b->Unit(benchmark::kMillisecond)->UseRealTime();
}

/// Of a backend by name: "cpu", "cuda" (device 0), "cuda_all" (every device).
Context new_context(const std::string& backend);
/// Context of a backend by name, made once; null, and the benchmark skipped, where there is none.
const Context* context(benchmark::State& state, const std::string& backend);

}  // namespace gpureg::bench
