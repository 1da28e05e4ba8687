// SPDX-License-Identifier: BSD-3-Clause
#include <benchmark/benchmark.h>

#include "synthetic.hpp"

namespace gpureg::pose_graph {
namespace {

void solve(benchmark::State& state, Robust robust) {
  const int nodes = static_cast<int>(state.range(0));
  const Graph graph = bench::city(nodes, 3 * nodes, 1);
  Options options;
  options.robust = robust;
  options.threads = 2;
  Result result;
  for (auto _ : state) result = optimize(graph, options);
  state.counters["edges"] = static_cast<double>(graph.edges.size());
  state.counters["iterations"] = result.iterations;
  state.counters["accepted"] = static_cast<double>(result.accepted_loops(graph));
  state.counters["converged"] = result.converged();
}

void BM_LeastSquares(benchmark::State& state) { solve(state, Robust::none); }
void BM_Gnc(benchmark::State& state) { solve(state, Robust::gnc); }

BENCHMARK(BM_LeastSquares)->Arg(2000)->Arg(10000)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(BM_Gnc)->Arg(2000)->Arg(10000)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace gpureg::pose_graph
