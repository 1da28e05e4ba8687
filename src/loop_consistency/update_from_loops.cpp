// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "common/stop_scope.hpp"
#include "loop_consistency/consistency_graph.hpp"
#include "math/exponential.hpp"

namespace gpureg {
namespace {

double ratio(const ConsistencyGraph& graph, std::uint32_t a, std::uint32_t b, std::uint32_t c,
             const UnalignedIsometry3d& a_from_b, const UnalignedIsometry3d& b_from_c,
             const UnalignedIsometry3d& a_from_c) {
  return graph.closing_ratio(
      a_from_b * b_from_c * a_from_c.inverse(), 1.0,
      {graph.centre(a), a_from_b * graph.centre(b), a_from_c * graph.centre(c)});
}

/// Adds the evidence of the loop over a third cloud to the log odds of each candidate. The
/// candidates of the other two edges count by their probabilities.
void update_from_loop(const ConsistencyGraph& graph, const ConsistencyEdge& edge,
                      const ConsistencyEdge& from_first, const ConsistencyEdge& from_second,
                      std::uint32_t third, std::vector<double>& log_odds) {
  double known = 0;
  for (const double p : from_first.probability)
    for (const double q : from_second.probability) known += p * q;
  for (std::size_t m = 0; m < edge.candidates.size(); ++m) {
    const UnalignedIsometry3d& first_from_second = edge.candidates[m].first_from_second;
    double likelihood = std::max(0.0, 1.0 - known);
    for (std::size_t f = 0; f < from_first.candidates.size(); ++f) {
      const UnalignedIsometry3d first_from_third = from_first.pose(f, edge.first);
      for (std::size_t g = 0; g < from_second.candidates.size(); ++g)
        likelihood += from_first.probability[f] * from_second.probability[g] *
                      ratio(graph, edge.first, edge.second, third, first_from_second,
                            from_second.pose(g, edge.second), first_from_third);
    }
    log_odds[m] += portable::log(likelihood);
  }
}

std::vector<double> updated(const ConsistencyGraph& graph, ConsistencyEdge& edge) {
  const double most = portable::log(graph.options().max_odds_factor);
  std::vector<double> log_odds(edge.candidates.size(), 0.0);
  const std::vector<ConsistencyNeighbor>&first = graph.neighbors(edge.first),
        &second = graph.neighbors(edge.second);
  edge.loops = 0;
  for (std::size_t i = 0, j = 0; i < first.size() && j < second.size();) {
    if (first[i].cloud == second[j].cloud) {
      update_from_loop(graph, edge, graph.edges()[first[i].edge], graph.edges()[second[j].edge],
                       first[i].cloud, log_odds);
      ++edge.loops;
      ++i;
      ++j;
    } else if (first[i].cloud < second[j].cloud) {
      ++i;
    } else {
      ++j;
    }
  }
  std::vector<double> out = edge.probability;
  if (edge.loops == 0) return out;
  double none = 1.0, sum = 0;
  for (std::size_t m = 0; m < out.size(); ++m) {
    none -= edge.candidates[m].prior;
    sum += out[m] = edge.candidates[m].prior * portable::exp(std::clamp(log_odds[m], -most, most));
  }
  sum += std::max(none, kMinNoneProbability);
  for (std::size_t m = 0; m < out.size(); ++m)
    out[m] = 0.5 * edge.probability[m] + 0.5 * out[m] / sum;
  return out;
}

}  // namespace

void update_from_loops(ConsistencyGraph& graph) {
  std::vector<ConsistencyEdge>& edges = graph.edges();
  std::vector<std::vector<double>> next(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    StopScope::poll();
    next[e] = updated(graph, edges[e]);
  }
  for (std::size_t e = 0; e < edges.size(); ++e) edges[e].probability = std::move(next[e]);
}

}  // namespace gpureg
