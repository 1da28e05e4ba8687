// SPDX-License-Identifier: BSD-3-Clause
// One optimisation of a g2o file, for bench/pose_graph/run.py: poses, edge states and seconds as
// text.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "gpureg/error.hpp"
#include "gpureg/pose_graph.hpp"

int main(int argc, char** argv) {
  using namespace gpureg::pose_graph;
  if (argc < 4) {
    std::fprintf(stderr,
                 "usage: %s IN.g2o OUT.txt none|gnc|gnc_plain|line_process|loopsmart [THREADS]\n",
                 argv[0]);
    return 2;
  }
  try {
    const Graph graph = read_g2o(argv[1], G2oRotation::angle);
    const std::string method = argv[3];
    Options options = method == "loopsmart" ? Options::loopsmart() : Options{};
    if (method == "none") options.robust = Robust::none;
    if (method == "line_process") options.robust = Robust::line_process;
    if (method == "gnc_plain") options.gnc.consensus = false;
    if (argc > 4) options.threads = std::atoi(argv[4]);
    const auto begin = std::chrono::steady_clock::now();
    const Result result = optimize(graph, options);
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    std::FILE* out = std::fopen(argv[2], "w");
    if (!out) return 1;
    std::fprintf(out, "%s %.6f %d %.17g %.17g %zu\n", to_string(result.status), seconds,
                 result.iterations, result.initial_cost, result.final_cost,
                 result.components.size());
    for (const auto& pose : result.world_from_node) {
      for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 4; ++column)
          std::fprintf(out, "%.17g ", pose.matrix()(row, column));
      std::fprintf(out, "\n");
    }
    for (const EdgeResult& edge : result.edges)
      std::fprintf(out, "%d ", edge.state == EdgeState::accepted);
    std::fprintf(out, "\n");
    std::fclose(out);
  } catch (const gpureg::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
