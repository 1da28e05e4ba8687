// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph/robust/bridges.hpp"
#include "math/exponential.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace gpureg::pose_graph {
namespace {

struct Visit {
  int node;
  int by_edge;  ///< the edge that the search came by; -1 at a root
  std::size_t next = 0;
};

/// Edges whose removal splits the graph of the edges with a weight. Tarjan 1974, without recursion.
std::vector<int> bridges(const Problem& problem, const Selection& selection) {
  const int nodes = problem.node_count();
  std::vector<std::vector<int>> incident(nodes);
  for (int k = 0; k < problem.edge_count(); ++k) {
    if (selection.weights[k] == 0) continue;
    incident[problem.edges[k].source].push_back(k);
    incident[problem.edges[k].target].push_back(k);
  }
  std::vector<int> out, order(nodes, -1), low(nodes, 0);
  int count = 0;
  for (int root = 0; root < nodes; ++root) {
    if (order[root] >= 0) continue;
    std::vector<Visit> stack{{root, -1}};
    order[root] = low[root] = count++;
    while (!stack.empty()) {
      Visit& visit = stack.back();
      const int node = visit.node;
      if (visit.next < incident[node].size()) {
        const int k = incident[node][visit.next++];
        if (k == visit.by_edge) continue;
        const EdgeTerm& edge = problem.edges[k];
        const int other = edge.source == node ? edge.target : edge.source;
        if (order[other] >= 0) {
          low[node] = std::min(low[node], order[other]);
        } else {
          order[other] = low[other] = count++;
          stack.push_back({other, k});
        }
        continue;
      }
      const int by_edge = visit.by_edge;
      stack.pop_back();
      if (stack.empty()) continue;
      const int parent = stack.back().node;
      low[parent] = std::min(low[parent], low[node]);
      if (low[node] > order[parent]) out.push_back(by_edge);
    }
  }
  return out;
}

}  // namespace

void reject_unchecked(const Problem& problem, double min_confidence, Selection& selection) {
  // Fixed nodes and priors check loops, too, without a cycle.
  int anchors = static_cast<int>(problem.priors.size());
  for (const char held : problem.held) anchors += held;
  if (anchors > 1) return;
  for (const int k : bridges(problem, selection)) {
    const EdgeTerm& edge = problem.edges[k];
    if (edge.odometry) continue;
    const double prior = problem.modes[edge.first_mode + selection.modes[k]].prior;
    const double confidence = portable::logistic(0.5 * prior);
    // Log odds and back: a confidence of exactly the minimum stays.
    constexpr double rounding = 1e-12;
    if (confidence < min_confidence - rounding) selection.weights[k] = 0;
  }
}

}  // namespace gpureg::pose_graph
