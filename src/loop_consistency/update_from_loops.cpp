// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "common/for_each_on.hpp"
#include "common/stop_scope.hpp"
#include "loop_consistency/consistency_graph.hpp"
#include "math/exponential.hpp"

namespace gpureg {
namespace {

/// Fewer take less time than starting a thread.
constexpr std::size_t kEdgesOfThread = 64;

/// The modes of an edge, as poses of its other cloud in one of its two, and back.
struct Poses {
  std::vector<UnalignedIsometry3d> here_from_there, there_from_here;
  std::vector<Eigen::Vector3d> centre;  ///< of the other cloud, here
};

/// Takes the memory of `out`.
void poses_of(const ConsistencyGraph& graph, const ConsistencyEdge& edge, std::uint32_t here,
              Poses& out) {
  const Eigen::Vector3d& centre = graph.centre(edge.first == here ? edge.second : edge.first);
  out.here_from_there.clear();
  out.there_from_here.clear();
  out.centre.clear();
  for (std::size_t m = 0; m < edge.candidates.size(); ++m) {
    out.here_from_there.push_back(edge.pose(m, here));
    out.there_from_here.push_back(out.here_from_there.back().inverse());
    out.centre.push_back(out.here_from_there.back() * centre);
  }
}

/// What the loops of one edge need, so that each takes no memory of its own.
struct Loop {
  Poses second, third_in_first, third_in_second;
};

/// Adds the evidence of the loop over a third cloud to the log odds of each candidate. The
/// candidates of the other two edges count by their probabilities.
void update_from_loop(const ConsistencyGraph& graph, const ConsistencyEdge& edge,
                      const ConsistencyEdge& from_first, const ConsistencyEdge& from_second,
                      Loop& loop, std::vector<double>& log_odds) {
  poses_of(graph, from_first, edge.first, loop.third_in_first);
  poses_of(graph, from_second, edge.second, loop.third_in_second);
  double known = 0;
  for (const double p : from_first.probability)
    for (const double q : from_second.probability) known += p * q;
  for (std::size_t m = 0; m < edge.candidates.size(); ++m) {
    double likelihood = std::max(0.0, 1.0 - known);
    for (std::size_t f = 0; f < from_first.candidates.size(); ++f)
      for (std::size_t g = 0; g < from_second.candidates.size(); ++g)
        likelihood +=
            from_first.probability[f] * from_second.probability[g] *
            graph.closing_ratio(
                loop.second.here_from_there[m] * loop.third_in_second.here_from_there[g] *
                    loop.third_in_first.there_from_here[f],
                1.0,
                {graph.centre(edge.first), loop.second.centre[m], loop.third_in_first.centre[f]});
    log_odds[m] += portable::log(likelihood);
  }
}

std::vector<double> updated(const ConsistencyGraph& graph, ConsistencyEdge& edge, Loop& loop) {
  const double most = portable::log(graph.options().max_odds_factor);
  std::vector<double> log_odds(edge.candidates.size(), 0.0);
  const std::vector<ConsistencyNeighbor>&first = graph.neighbors(edge.first),
        &second = graph.neighbors(edge.second);
  poses_of(graph, edge, edge.first, loop.second);
  edge.loops = 0;
  for (std::size_t i = 0, j = 0; i < first.size() && j < second.size();) {
    if (first[i].cloud == second[j].cloud) {
      update_from_loop(graph, edge, graph.edges()[first[i].edge], graph.edges()[second[j].edge],
                       loop, log_odds);
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
  const std::size_t threads =
      std::min(static_cast<std::size_t>(thread_count(graph.options().threads)),
               edges.size() / kEdgesOfThread + 1);
  for_each_on(
      threads, edges.size(), [] { return Loop(); },
      [&](std::size_t e, Loop& loop) {
        StopScope::poll();
        next[e] = updated(graph, edges[e], loop);
      });
  for (std::size_t e = 0; e < edges.size(); ++e) edges[e].probability = std::move(next[e]);
}

}  // namespace gpureg
